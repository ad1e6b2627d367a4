"""Runs of a realistic case: the motion with any of the hidden pieces, and its log."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fish_env.data import CommandSteps, Run
from fish_env.params import FishParams
from tests.hidden.disturbances import draw_push
from tests.hidden.excitation import exciting, merged
from tests.hidden.realistic.catalogue import BY_SENSORS
from tests.hidden.realistic.faults import FAULTS
from tests.hidden.realistic.hidden import Piece, Values, added
from tests.hidden.realistic.plans import DEPTH, DURATION, SHALLOW
from tests.hidden.realistic.sensors import (
    STEP,
    Motion,
    derived,
    noisy,
    sampled,
    systematic,
)
from tests.hidden.recording import ATTEMPTS, better_depth, upright, within_tank
from tests.hidden.simulate import Push, Start, Swim

OWN = ("water_density", "tail_phase")
"""Pieces that change the fish or its start instead of the equations."""
WITH_CORNERS = {"servo_rate_limit", "servo_torque_limit", "servo_backlash"}
FINER = 4
"""What makes the tail's rate jump at any time, and how many times finer steps are with it: errors
are of first order there, 3 mm and 0.02 rad/s after 30 s in steps of 4 ms."""
FISH, PUSHES = "coefficients", "disturbance"
"""Names of two more hidden things: the true fish, and the random push."""
LATEST = 0.5
"""s. How far beyond the last stamp a motion is needed at most."""


@dataclass(frozen=True)
class Drawn:
    """A run before it is swum.

    Attributes:
        start: position and heading at rest.
        push: the random push.
        commands: (n, 6) as logged: times by the commands' clock, frequencies as asked.
        stamps: (T,) times of the samples by the measurements' clock, s.
    """

    start: Start
    push: Push
    commands: np.ndarray
    stamps: np.ndarray


@dataclass(frozen=True)
class Case:
    """What all runs share.

    Attributes:
        nominal: the fish that the dataset names.
        fish: the true one.
        pieces: everything hidden in effects and sensors.
        fault: a wrong input, or none.
        rate: true samples per second.
        disturbance: colour, force, time constant and frame of the push.
        phase_known: whether the dataset tells the tail's phase at the start.
        motions: what was swum already, by run and pieces.
    """

    nominal: FishParams
    fish: FishParams
    pieces: tuple[Piece, ...]
    fault: str = ""
    rate: float = 25.0
    disturbance: Mapping[str, object] = field(default_factory=dict)
    phase_known: bool = True
    motions: dict[tuple[object, ...], Motion] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Names of all hidden things that a budget has."""
        return frozenset({FISH, PUSHES, *(piece.name for piece in self.pieces)})

    def values(self, run: int, present: Collection[str]) -> Values:
        """Parameters of a run in which some of the pieces act."""
        return added(run, [piece for piece in self.pieces if piece.name in present])


def clocks(values: Values) -> tuple[float, float]:
    """True time per time of the commands' clock, and of the measurements' clock."""
    log = values.get("clock_scale", {}).get("scale", 1.0)
    return log, log * values.get("clock_skew", {}).get("scale", 1.0)


def motion_key(case: Case, present: Collection[str]) -> frozenset[str]:
    """Those of the pieces that change the motion."""
    moving = {piece.name for piece in case.pieces if piece.moves} | {FISH, PUSHES}
    return frozenset(moving & set(present))


def swim(case: Case, drawn: Drawn, run: int, present: Collection[str]) -> Motion:
    """The true motion of a run in which some of the pieces act; kept for the next time."""
    key = (run, drawn.start.position, motion_key(case, present))
    if key not in case.motions:
        fish, times = swimmer(case, drawn, run, present)
        case.motions[key] = Motion(times, fish.run(float(times[-1]), times))
    return case.motions[key]


def swimmer(
    case: Case, drawn: Drawn, run: int, present: Collection[str], step: float = STEP
) -> tuple[Swim, np.ndarray]:
    """A fish at the start of its commands, and the grid of times to swim through.

    Args:
        case: fish and hidden things.
        drawn: the run.
        run: its number.
        present: names of what acts.
        step: of the grid, and longest step, s.
    """
    values = case.values(run, present)
    by_commands, by_sensors = clocks(values)
    numbers = (case.fish if FISH in present else case.nominal).values()
    density = values.get("water_density", {}).get("scale", 1.0)
    numbers |= {path: density * numbers[path] for path in ("water.density", "mass.buoyancy")}
    phase = values.get("tail_phase", {}).get("offset", 0.0)
    fish = Swim(
        numbers,
        physics(values),
        replace(drawn.start, phase=drawn.start.phase + phase),
        drawn.push if PUSHES in present else Push(),
        step / FINER if WITH_CORNERS & values.keys() else step,
    )
    commands = drawn.commands.copy()
    commands[:, 0] *= by_commands
    fish.command(commands)
    end = max(drawn.stamps[-1] * by_sensors, commands[-1, 0]) + LATEST
    return fish, np.arange(math.ceil(end / step) + 1) * step


def physics(values: Values) -> Values:
    """The parameters that the equations of motion read, by their names there."""
    out: Values = {}
    for name, given in values.items():
        if name in BY_SENSORS or name in OWN:
            continue
        out[name] = dict(given)
    return out


def draw_run(case: Case, run: int, rng: np.random.Generator) -> Drawn:
    """A run in which the fish stays upright and in the water."""
    shallow = any(piece.name == "surface_piercing" for piece in case.pieces)
    for _ in range(ATTEMPTS):
        drawn = _draw(case, run, SHALLOW if shallow else DEPTH, rng)
        motion = swim(case, drawn, run, case.names)
        if upright(motion) and not (shallow or within_tank(motion)):
            x, y, _ = drawn.start.position
            drawn = replace(
                drawn, start=replace(drawn.start, position=(x, y, better_depth(motion)))
            )
            motion = swim(case, drawn, run, case.names)
        if upright(motion) and (shallow or within_tank(motion)):
            return drawn
    raise RuntimeError(f"no plausible run {run} was found")


def _draw(case: Case, run: int, depth: tuple[float, float], rng: np.random.Generator) -> Drawn:
    about, values = case.disturbance, case.values(run, case.names)
    by_commands, by_sensors = clocks(values)
    style = ("steps", "waves")[run % 2]
    commands = merged(exciting(case.rate, DURATION, style, rng))
    commands[:, 0] = np.round(commands[:, 0], 6) / by_commands
    # A beat that is far off is so in the log: the tail itself beats as tails do.
    far = values.get("frequency_scale", {}).get("scale", 1.0)
    if abs(math.log(far)) > 0.1:
        commands[:, 3] = np.round(commands[:, 3] / far, 6)
    times = np.round(np.arange(round(DURATION * case.rate) + 1) / case.rate, 6)
    start = Start(
        position=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(*depth)),
        euler=(0.0, 0.0, rng.uniform(-math.pi, math.pi)),
        phase=0.0 if case.phase_known else rng.uniform(0.0, 2.0 * math.pi),
    )
    push = draw_push(
        str(about["colour"]), float(about["force"]), float(about["time_constant"]),
        bool(about["inertial"]), (0.0, DURATION * 1.1 + 1.0), rng,
    )  # fmt: skip
    return Drawn(start, push, commands, times / by_sensors)


def measured_run(
    case: Case, drawn: Drawn, run: int, noise: Mapping[str, float], rng: np.random.Generator
) -> Run:
    """One run in the project's format, with everything that is wrong with it."""
    values, motion = case.values(run, case.names), swim(case, drawn, run, case.names)
    when = drawn.stamps * clocks(values)[1]
    spread = values.get("exposure_jitter", {}).get("sd", 0.0)
    jitter = spread * rng.standard_normal(len(when))
    clean = sampled(motion, systematic(motion, values), when, values, jitter)
    beat = CommandSteps(drawn.commands[:, 0], drawn.commands[:, 1:])
    moving = beat.at(drawn.stamps)[:, 1] > 0.0
    channels, rows = noisy(clean, noise, moving, values, rng), drawn.commands
    if "derived_channels" in values:
        channels = derived(channels, drawn.stamps)
    if case.fault:
        channels, rows = FAULTS[case.fault].apply(channels, rows)
    return Run.from_steps(
        f"r{run + 1:02d}",
        drawn.stamps,
        channels,
        CommandSteps(rows[:, 0], rows[:, 1:]),
        start="rest",
        tail_phase=0.0 if case.phase_known else None,
    )
