"""Runs of the hidden fish, as an experimenter would record them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fish_env.data import CommandSteps, Dataset, Run, write_dataset
from fish_env.params import FishParams
from tests.hidden.controller import Controller, draw_program
from tests.hidden.disturbances import draw_push
from tests.hidden.excitation import POOR, exciting, merged
from tests.hidden.measurement import channels_of, clock, distorted, true_times
from tests.hidden.plans import Plan
from tests.hidden.servo import PHASE, TIME
from tests.hidden.simulate import Push, Start, Swim
from tests.hidden.truth import Truth

SHALLOWEST, DEEPEST = 0.08, 2.5
STEEPEST, MOST_ROLL = math.radians(55.0), math.radians(70.0)
FASTEST = 0.8
ATTEMPTS = 400
BEFORE = 4.0
"""s. How long a fish with an unknown start has swum when its record begins."""


@dataclass(frozen=True)
class Experiment:
    """What the runs of a case share: fish, effects, disturbance, sensors, randomness."""

    truth: Truth
    fish: FishParams
    plan: Plan
    streams: list[np.random.Generator]

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        return {**self.truth.effects, **self.truth.foreign}


@dataclass(frozen=True)
class Draw:
    """What is drawn for one run before it is swum."""

    index: int
    rng: np.random.Generator
    start: Start
    push: Push
    noise: Mapping[str, np.ndarray]
    times: np.ndarray


@dataclass(frozen=True)
class Recording:
    """One run: times, channels as measured, commands (n, 6), phase of the tail, true states."""

    times: np.ndarray
    channels: Mapping[str, np.ndarray]
    commands: np.ndarray
    phase: float
    states: np.ndarray


def record(experiment: Experiment) -> tuple[Truth, list[Recording]]:
    """All runs of a case, and the truth with what was drawn for them."""
    plan, rng = experiment.plan, experiment.streams[1]
    disturbance = {
        "colour": str(rng.choice(plan.colours)),
        "force": float(rng.uniform(*plan.force)),
        "time_constant": float(np.exp(rng.uniform(*np.log(plan.memory)))),
        "inertial": bool(rng.integers(2)),
    }
    quality = experiment.streams[2].uniform(0.75, 1.3)
    noise = {name: float(sd * quality) for name, sd in plan.noise.items()}
    truth = replace(experiment.truth, disturbance=disturbance, noise=noise)
    case = replace(experiment, truth=truth)
    return truth, [plausible_run(case, index) for index in range(plan.runs)]


def plausible_run(case: Experiment, index: int) -> Recording:
    """A run in which the fish stays in the tank and upright; schedules are redrawn until it does.

    Where only the depth is wrong, the run is started deeper or shallower instead.
    """
    for _ in range(ATTEMPTS):
        draw = draw_run(case, index)
        seed = int(draw.rng.integers(2**31))
        recording = swim(case, draw, seed)
        if upright(recording) and not within_tank(recording):
            x, y, _ = draw.start.position
            start = replace(draw.start, position=(x, y, better_depth(recording)))
            recording = swim(case, replace(draw, start=start), seed)
        if upright(recording) and within_tank(recording):
            return recording
    raise RuntimeError(f"{case.truth.tier} {case.truth.seed}: no plausible run {index} was found")


def draw_run(case: Experiment, index: int) -> Draw:
    """Start, push and noise of a run."""
    plan, rng, disturbance = case.plan, case.streams[0], case.truth.disturbance
    times = np.arange(round(plan.duration * plan.rate) + 1) / plan.rate
    start = Start(
        position=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(*plan.depth)),
        euler=(0.0, 0.0, rng.uniform(-math.pi, math.pi)),
        phase=rng.uniform(0.0, 2 * math.pi) if plan.start == "unknown" else 0.0,
    )
    push = draw_push(
        disturbance["colour"],
        disturbance["force"],
        disturbance["time_constant"],
        disturbance["inertial"],
        (-BEFORE, plan.duration * 1.1),
        case.streams[1],
    )
    noise = {
        name: sd * case.streams[2].standard_normal(len(times))
        for name, sd in case.truth.noise.items()
    }
    return Draw(index, rng, start, push, noise, times)


def swim(case: Experiment, draw: Draw, seed: int) -> Recording:
    """Swims a drawn run; the same seed gives the same schedule."""
    rng = np.random.default_rng(seed)
    if case.plan.schedule == "controller":
        return swim_closed_loop(case, draw, rng)
    return swim_open_loop(case, draw, rng)


def schedule(plan: Plan, index: int, rng: np.random.Generator) -> np.ndarray:
    """Commands (n, 6), from `BEFORE` the record on where the start is unknown."""
    before = BEFORE if plan.start == "unknown" else 0.0
    if plan.schedule == "exciting":
        still = 0.0 if before else None
        style = ("steps", "waves")[index % 2]
        rows = exciting(plan.rate, plan.duration + before, style, rng, still)
    else:
        rows = POOR[plan.schedule](plan.rate, plan.duration + before, rng)
    rows[:, 0] -= before
    return merged(rows)


def swim_open_loop(case: Experiment, draw: Draw, rng: np.random.Generator) -> Recording:
    """A run whose commands were chosen beforehand."""
    commands = schedule(case.plan, draw.index, rng)
    given = commands.copy()
    given[:, 0] *= clock(case.effects)
    when = np.maximum(true_times(draw.times, case.effects), given[0, 0])
    fish = Swim(case.fish.values(), case.effects, draw.start, draw.push)
    fish.command(given)
    unique, back = np.unique(when, return_inverse=True)
    states = fish.run(float(unique[-1]), unique)[back]
    channels = noisy(distorted(channels_of(states), case.effects), draw.noise)
    return Recording(draw.times, channels, since_start(commands), phase_at_start(fish), states)


def swim_closed_loop(case: Experiment, draw: Draw, rng: np.random.Generator) -> Recording:
    """A run whose commands follow the measurements, one control period at a time."""
    scale = clock(case.effects)
    program = draw_program(case.plan.rate, case.plan.duration, rng)
    fish = Swim(case.fish.values(), case.effects, draw.start, draw.push)
    when = np.maximum(true_times(draw.times, case.effects), 0.0)
    states = np.empty((len(draw.times), len(fish.state)))
    states[:] = fish.state
    controller = None
    ends = np.append(program.grid[1:], max(when[-1], program.grid[-1] + 1e-6))
    for k, (begin, end) in enumerate(zip(program.grid, ends, strict=True)):
        # The newest record that the controller can have read by now.
        latest = max(int(np.searchsorted(when, begin + 1e-9, "right")) - 1, 0)
        latest = min(latest, int(np.searchsorted(scale * draw.times, begin + 1e-9, "right")) - 1)
        seen = measured_at(case, draw, states, latest)
        controller = controller or Controller(program, seen)
        fish.command(controller.commands(k, seen)[None])
        due = np.flatnonzero((when > begin) & (when <= end))
        if k == 0:
            due = np.flatnonzero(when <= end)
        unique, back = np.unique(when[due], return_inverse=True)
        states[due] = fish.run(float(end), unique)[back]
    channels = noisy(distorted(channels_of(states), case.effects), draw.noise)
    told = merged(fish.table[:, :6])
    told[:, 0] /= scale
    return Recording(draw.times, channels, told, 0.0, states)


def measured_at(case: Experiment, draw: Draw, states: np.ndarray, k: int) -> dict[str, float]:
    """What the sensors show at sample k; the yaw winds on from the start."""
    true = distorted(channels_of(states[: k + 1]), case.effects)
    return {name: float(true[name][-1] + draw.noise[name][k]) for name in draw.noise}


def noisy(
    channels: Mapping[str, np.ndarray], noise: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """The channels that are measured, with their noise."""
    return {name: channels[name] + error for name, error in noise.items()}


def since_start(commands: np.ndarray) -> np.ndarray:
    """The commands from time zero on, with the row that then holds."""
    later = commands[:, 0] > 0.0
    held = commands[~later][-1].copy()
    held[0] = 0.0
    return np.concatenate([held[None], commands[later]])


def phase_at_start(fish: Swim) -> float:
    """Phase of the commanded tail at time zero, rad."""
    row = max(int(np.searchsorted(fish.table[:, TIME], 0.0, "right")) - 1, 0)
    at = fish.table[row]
    scale = float(fish.extra["frequency_scale_scale"])
    sag = float(fish.extra["battery_sag_rate"])
    run = -at[TIME] + 0.5 * sag * at[TIME] ** 2
    return float((at[PHASE] + 2 * math.pi * scale * at[3] * run) % (2 * math.pi))


def upright(recording: Recording) -> bool:
    """Whether the fish swam as fish do, without tumbling."""
    true = channels_of(recording.states)
    return bool(
        np.isfinite(recording.states).all()
        and np.abs(true["pitch"]).max() < STEEPEST
        and np.abs(true["roll"]).max() < MOST_ROLL
        and np.linalg.norm(recording.states[:, 12:15], axis=1).max() < FASTEST
    )


def within_tank(recording: Recording) -> bool:
    depth = recording.states[:, 2]
    return bool(depth.min() > SHALLOWEST and depth.max() < DEEPEST)


def better_depth(recording: Recording) -> float:
    """Start depth that brings the same motion nearest to the surface, or off the floor."""
    depth = recording.states[:, 2]
    if depth.min() <= SHALLOWEST:
        return float(depth[0] + SHALLOWEST + 0.1 - depth.min())
    return float(depth[0] + DEEPEST - 0.1 - depth.max())


def write(case: Experiment, recorded: tuple[Truth, list[Recording]], folder: Path) -> Truth:
    """Writes the dataset."""
    truth, recordings = recorded
    rng = case.streams[2]
    declared = bool(rng.integers(2))
    runs = tuple(
        measured_run(case.plan, recording, f"r{index + 1:02d}", rng)
        for index, recording in enumerate(recordings)
    )
    noise = truth.noise if declared else {}
    write_dataset(Dataset(f"trial-{truth.seed:04d}", truth.fish, runs, noise), folder)
    phases = [recording.phase for recording in recordings]
    return replace(truth, about={"noise_declared": declared, "tail_phases": phases})


def measured_run(plan: Plan, recording: Recording, name: str, rng: np.random.Generator) -> Run:
    """One run in the project's format; a share of its samples may be lost."""
    lost = rng.random(len(recording.times)) < plan.missing
    lost[[0, -1]] = False
    return Run.from_steps(
        name,
        recording.times,
        {key: np.where(lost, np.nan, values) for key, values in recording.channels.items()},
        CommandSteps(recording.commands[:, 0], recording.commands[:, 1:]),
        start=plan.start,
        tail_phase=recording.phase if plan.start == "rest" else None,
    )
