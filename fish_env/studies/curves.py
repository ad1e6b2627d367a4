"""What the pictures of `robofish plot` show, computed for any fish."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.model.state import INPUTS
from fish_env.params import FishParams
from fish_env.plotting.forces import Breakdown
from fish_env.plotting.motions import Swim
from fish_env.plotting.polar import Polar
from fish_env.plotting.trim import TrimCurve
from fish_env.simulator import Simulator
from fish_env.steady import steady_motion
from fish_env.studies.portrait import trim_pitch, trim_roll

AMPLITUDE = np.radians(20.0)
OFFSET = np.radians(20.0)
DISPLACEMENT_M = -0.008
"""Fore: the fish dives."""
MOTIONS = {
    "rectilinear": (0.0, AMPLITUDE, 2.0, 0.0, 0.0),
    "turning": (OFFSET, AMPLITUDE, 2.0, 0.0, 0.0),
    "gliding": (0.0, AMPLITUDE, 2.0, DISPLACEMENT_M, 0.0),
    "spiral": (OFFSET, AMPLITUDE, 3.0, DISPLACEMENT_M, 0.0),
}
"""The four motions of the paper: commands in the order of all command arrays."""
SWIM_S = 40.0
BEAT_SAMPLES = 20
POLAR_OFFSETS = np.radians(np.arange(-45.0, 46.0, 3.0))
POLAR_AMPLITUDES_DEG = (10.0, 20.0, 30.0, 40.0)
POLAR_FREQUENCIES_HZ = (1.0, 1.5, 2.0, 2.5, 3.0)
POLAR_AMPLITUDE, POLAR_FREQUENCY_HZ = np.radians(25.0), 2.0
"""What is held while the other is varied."""
SETTLED_BEATS = 60
PHASES = 181
TRIM_FREQUENCIES_HZ = np.array([1.0, 2.0, 3.0])
TRIM_POINTS = 9
LARGEST_ANGLE = np.radians(40.0)


def four_motions(fish: FishParams) -> list[Swim]:
    """Rectilinear, turning, gliding and spiral motion from rest."""
    simulator = Simulator(fish)
    swims = []
    for name, command in MOTIONS.items():
        row = {"t": 0.0, **dict(zip(INPUTS, command, strict=True))}
        rate_hz = BEAT_SAMPLES * row["tail_frequency"]
        swim = simulator.run([row], SWIM_S, rate_hz=rate_hz)
        swims.append(Swim(f"{name}\n{_in_words(row)}", swim, BEAT_SAMPLES))
    return swims


def _in_words(row: dict[str, float]) -> str:
    """What tells one motion from another."""
    words = f"{row['tail_frequency']:g} Hz"
    if row["tail_offset"]:
        words += f", offset {np.degrees(row['tail_offset']):.0f} deg"
    if row["block_displacement"]:
        words += f"\nblock {100.0 * row['block_displacement']:+.1f} cm"
    return words


def polars(fish: FishParams) -> tuple[Polar, Polar]:
    """Steady speed and yaw rate over the offset, for several frequencies, then amplitudes."""
    held = f"amplitude {np.degrees(POLAR_AMPLITUDE):.0f} deg"
    over_frequency = [(f"{f:g} Hz", POLAR_AMPLITUDE, f) for f in POLAR_FREQUENCIES_HZ]
    over_amplitude = [
        (f"{a:g} deg", float(np.radians(a)), POLAR_FREQUENCY_HZ) for a in POLAR_AMPLITUDES_DEG
    ]
    return (
        _polar(fish, f"frequency varied, {held}", over_frequency),
        _polar(fish, f"amplitude varied, {POLAR_FREQUENCY_HZ:g} Hz", over_amplitude),
    )


def _polar(fish: FishParams, title: str, lines: list[tuple[str, float, float]]) -> Polar:
    commands = [(o, a, f, 0.0, 0.0) for _, a, f in lines for o in POLAR_OFFSETS]
    motion = steady_motion(fish, commands, tolerance=1e-3)
    shape = (len(lines), len(POLAR_OFFSETS))
    speed, yaw_rate = (motion[n].reshape(shape) for n in ("horizontal_speed", "yaw_rate"))
    return Polar(title, tuple(label for label, _, _ in lines), POLAR_OFFSETS, speed, yaw_rate)


def breakdown(fish: FishParams) -> Breakdown:
    """Forces and moments of every term over the last of many beats straight ahead."""
    simulator = Simulator(fish)
    command = MOTIONS["rectilinear"]
    beat_s = 1.0 / command[INPUTS.index("tail_frequency")]
    times = (SETTLED_BEATS + np.linspace(0.0, 1.0, PHASES)) * beat_s
    row = {"t": 0.0, **dict(zip(INPUTS, command, strict=True))}
    swim = simulator.run([row], sample_times_s=np.r_[0.0, times])
    wrenches = [
        simulator.wrench_by_term(state, command, float(t))
        for state, t in zip(swim.states[1:], times, strict=True)
    ]
    terms = {name: np.array([w[name] for w in wrenches]) for name in wrenches[0]}
    phase = swim["tail_phase"][1:]
    degrees = np.degrees(command[INPUTS.index("tail_amplitude")])
    title = f"{fish.name}, straight ahead, amplitude {degrees:.0f} deg, {1.0 / beat_s:g} Hz"
    return Breakdown(phase - phase[0], terms, title)


def trim_curves(fish: FishParams) -> tuple[TrimCurve, TrimCurve]:
    """Over the block's displacement within the crank's reach, and over its angle."""
    reach = Simulator(fish).crank.reach
    largest = 0.95 * min(abs(end) for end in reach)
    displacements = np.linspace(-largest, largest, TRIM_POINTS)
    angles = np.linspace(-LARGEST_ANGLE, LARGEST_ANGLE, TRIM_POINTS)
    none = np.zeros(TRIM_POINTS)
    return _trim_curve(fish, displacements, none), _trim_curve(fish, none, angles)


def _trim_curve(fish: FishParams, displacement: FloatArray, angle: FloatArray) -> TrimCurve:
    simulator = Simulator(fish)
    commands = [
        (0.0, AMPLITUDE, frequency, d, a)
        for frequency in TRIM_FREQUENCIES_HZ
        for d, a in zip(displacement, angle, strict=True)
    ]
    motion = steady_motion(fish, commands, tolerance=1e-3)
    shape = (len(TRIM_FREQUENCIES_HZ), len(displacement))
    return TrimCurve(
        block=displacement if displacement.any() else angle,
        rest_pitch=np.array([trim_pitch(simulator, d).angle for d in displacement]),
        rest_roll=np.array([trim_roll(simulator, a).angle for a in angle]),
        frequencies=TRIM_FREQUENCIES_HZ,
        motion={name: motion[name].reshape(shape) for name in ("pitch", "roll", "vertical_speed")},
    )
