"""Simulations behind the paper's figures.

Numbers of steady motion are means over whole tail beats after the transient, see
:func:`fish_env.steady.steady_motion`: U_r, U_g and U_s are its ``speed`` (U_r: the horizontal one),
w_t and w_s its ``yaw_rate``, R_t its ``turn_radius``; amplitudes are half ranges over those beats.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.extended import EffectValues, build_model
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from fish_env.steady import steady_motion
from fish_env.studies.paper import ranges
from fish_env.trajectory import Trajectory

Motion = dict[str, FloatArray]
SERIES_S, SERIES_HZ = 60.0, 50.0


@dataclass(frozen=True)
class Map:
    """Steady motion over two commands.

    Attributes:
        rows: Values of the first command (amplitude or offset, deg), shape (m,).
        frequencies: Tail frequencies, Hz, shape (n,).
        motion: Quantities of :func:`fish_env.steady.steady_motion`, each (m, n).
    """

    rows: FloatArray
    frequencies: FloatArray
    motion: Motion


@dataclass(frozen=True)
class Sweep:
    """Steady motion over the block's displacement: cm, shape (n,), and quantities, each (n,)."""

    displacements_cm: FloatArray
    motion: Motion


@dataclass(frozen=True)
class Acceleration:
    """Gliding from rest until the tank's depth is used up, one entry for each displacement.

    Attributes:
        displacements_cm: Block displacement, cm.
        mean_speed: Length of the path through one point a tail beat, over time, m/s.
        last_speed: Mean speed over the last beat, m/s.
        uniform_speed: Speed once steady, m/s.
        time_s: Time until the depth is used up, s.
    """

    displacements_cm: FloatArray
    mean_speed: FloatArray
    last_speed: FloatArray
    uniform_speed: FloatArray
    time_s: FloatArray


@dataclass(frozen=True)
class Study:
    """Everything the paper's figures show.

    Attributes:
        straight: Over amplitude and frequency, fish A.
        straight_series: By (amplitude deg, frequency Hz), from rest.
        turning: Over offset and frequency, fish A.
        turning_left: The same with negative offsets.
        turning_series: By (offset deg, frequency Hz), from rest.
        lagged: The turning map with `servo_lag`, by its time constant (s).
        gliding: Over displacement, fish B.
        accelerating: Gliding from rest to the tank's depth, fish B.
        spiral: Over displacement, fish B.
        spiral_series: One spiral from rest.
    """

    straight: Map
    straight_series: dict[tuple[float, float], Trajectory]
    turning: Map
    turning_left: Map
    turning_series: dict[tuple[float, float], Trajectory]
    lagged: dict[float, Map]
    gliding: Sweep
    accelerating: Acceleration
    spiral: Sweep
    spiral_series: Trajectory


def run_study(progress: Callable[[str], None] = lambda _: None) -> Study:
    """Runs all simulations; `progress` is called with a few words before each part."""
    with warnings.catch_warnings():
        # The paper's displacements go beyond the reach of the reconstructed crank; the report says.
        warnings.filterwarnings("ignore", message=".*beyond the crank's reach.*")
        return _run(progress)


def _run(progress: Callable[[str], None]) -> Study:
    progress("rectilinear motion")
    straight, straight_series = straight_map(), _series(straight_command, ranges.RECTILINEAR_SERIES)
    progress("turning motion")
    turning, turning_left = turning_map(), turning_map(sign=-1.0)
    turning_series = _series(turning_command, ranges.TURNING_SERIES)
    progress("turning motion with servo lag")
    lagged = {
        lag: turning_map({"servo_lag": {"time_constant": lag}}) for lag in ranges.SERVO_LAGS_S
    }
    progress("gliding motion")
    gliding, accelerating = sweep(gliding_command, ranges.GLIDING_CM), accelerating_glides()
    progress("spiral motion")
    return Study(
        straight=straight,
        straight_series=straight_series,
        turning=turning,
        turning_left=turning_left,
        turning_series=turning_series,
        lagged=lagged,
        gliding=gliding,
        accelerating=accelerating,
        spiral=sweep(spiral_command, ranges.SPIRAL_CM),
        spiral_series=_swim(ranges.FISH_B, spiral_command(ranges.SPIRAL_SERIES_CM)),
    )


def straight_command(amplitude_deg: float, frequency_hz: float) -> list[float]:
    """Commands of rectilinear motion, in SI units and the order of all command arrays."""
    return [0.0, np.radians(amplitude_deg), frequency_hz, 0.0, 0.0]


def turning_command(offset_deg: float, frequency_hz: float) -> list[float]:
    """Commands of turning motion."""
    amplitude = np.radians(ranges.TURNING_AMPLITUDE_DEG)
    return [np.radians(offset_deg), amplitude, frequency_hz, 0.0, 0.0]


def gliding_command(displacement_cm: float) -> list[float]:
    """Commands of gliding motion."""
    amplitude = np.radians(ranges.GLIDING_AMPLITUDE_DEG)
    return [0.0, amplitude, ranges.GLIDING_HZ, 0.01 * displacement_cm, 0.0]


def spiral_command(displacement_cm: float) -> list[float]:
    """Commands of spiral motion."""
    offset, amplitude = np.radians([ranges.SPIRAL_OFFSET_DEG, ranges.SPIRAL_AMPLITUDE_DEG])
    return [offset, amplitude, ranges.SPIRAL_HZ, 0.01 * displacement_cm, 0.0]


def straight_map() -> Map:
    """Rectilinear motion over amplitude and frequency."""
    return _map(straight_command, ranges.AMPLITUDES_DEG, None)


def turning_map(effects: EffectValues | None = None, sign: float = 1.0) -> Map:
    """Turning motion over offset and frequency, with effects beside the model."""
    return _map(turning_command, [sign * offset for offset in ranges.OFFSETS_DEG], effects)


def _map(
    command: Callable[[float, float], list[float]],
    rows: Iterable[float],
    effects: EffectValues | None,
) -> Map:
    values, frequencies = np.array(list(rows)), np.array(ranges.FREQUENCIES_HZ)
    commands = [command(row, f) for row in values for f in frequencies]
    motion = steady_motion(build_model(load_fish(ranges.FISH_A), effects), commands)
    shape = (len(values), len(frequencies))
    return Map(values, frequencies, {name: array.reshape(shape) for name, array in motion.items()})


def sweep(command: Callable[[float], list[float]], displacements_cm: Iterable[float]) -> Sweep:
    """Gliding or spiral motion of fish B over the block's displacement."""
    values = np.array(list(displacements_cm))
    motion = steady_motion(load_fish(ranges.FISH_B), [command(value) for value in values])
    return Sweep(values, motion)


def _swim(fish: str, command: list[float], duration_s: float = SERIES_S) -> Trajectory:
    names = (
        "tail_offset",
        "tail_amplitude",
        "tail_frequency",
        "block_displacement",
        "block_angle",
    )
    row = {"t": 0.0, **dict(zip(names, command, strict=True))}
    return Simulator(fish).run([row], duration_s, rate_hz=SERIES_HZ)


def _series(
    command: Callable[[float, float], list[float]], pairs: Iterable[tuple[float, float]]
) -> dict[tuple[float, float], Trajectory]:
    return {pair: _swim(ranges.FISH_A, command(*pair)) for pair in pairs}


def accelerating_glides() -> Acceleration:
    """Glides from rest until the fish has changed its depth by what the tank leaves it."""
    displacements = np.array(ranges.ACCELERATING_CM)
    uniform = sweep(gliding_command, displacements).motion["speed"]
    rows = [_accelerating_glide(gliding_command(value)) for value in displacements]
    mean, last, time = np.array(rows).T
    return Acceleration(displacements, mean, last, uniform, time)


def _accelerating_glide(command: list[float]) -> tuple[float, float, float]:
    """Mean speed, speed over the last beat (m/s) and time (s)."""
    trajectory = _swim(ranges.FISH_B, command)
    depth = np.abs(trajectory["z"])
    samples_a_beat = int(SERIES_HZ / ranges.GLIDING_HZ)
    end = int(np.argmax(depth >= ranges.TANK_DEPTH_M - ranges.HULL_HEIGHT_M))
    beats = slice(end % samples_a_beat, end + 1, samples_a_beat)
    points = np.column_stack([trajectory[name][beats] for name in "xyz"])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    time = len(lengths) / ranges.GLIDING_HZ
    return float(lengths.sum() / time), float(lengths[-1] * ranges.GLIDING_HZ), time
