"""Runs of the hidden fish, as an experimenter would record them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fish_env.data import CommandSteps, Dataset, Run, write_dataset
from fish_env.params import FishParams
from tests.hidden.disturbances import draw_push
from tests.hidden.excitation import exciting, merged
from tests.hidden.measurement import channels_of, distorted, true_times, with_noise
from tests.hidden.plans import Plan
from tests.hidden.simulate import Push, Start, Swim
from tests.hidden.truth import Truth

SHALLOWEST, DEEPEST = 0.08, 2.5
STEEPEST, MOST_ROLL = math.radians(55.0), math.radians(70.0)
FASTEST = 0.8
ATTEMPTS = 40


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
class Recording:
    """One run: times, measured channels without noise, commands, start."""

    times: np.ndarray
    channels: Mapping[str, np.ndarray]
    commands: np.ndarray
    start: Start
    states: np.ndarray


def record(experiment: Experiment) -> tuple[Truth, list[Recording]]:
    """All runs of a case, and the truth with what was drawn for them."""
    plan, rng = experiment.plan, experiment.streams[1]
    about = {
        "colour": str(rng.choice(plan.colours)),
        "force": float(rng.uniform(*plan.force)),
        "time_constant": float(np.exp(rng.uniform(*np.log(plan.memory)))),
        "inertial": bool(rng.integers(2)),
    }
    quality = experiment.streams[2].uniform(0.75, 1.3)
    noise = {name: float(sd * quality) for name, sd in plan.noise.items()}
    truth = replace(experiment.truth, disturbance=about, noise=noise)
    case = replace(experiment, truth=truth)
    return truth, [plausible_run(case, index) for index in range(plan.runs)]


def plausible_run(case: Experiment, index: int) -> Recording:
    """A run in which the fish stays in the tank and upright; schedules are redrawn until it does.

    Where only the depth is wrong, the run is started deeper or shallower instead.
    """
    for _ in range(ATTEMPTS):
        swim = draw_run(case, index)
        recording = swim(None)
        if not upright(recording):
            continue
        if not within_tank(recording):
            recording = swim(better_depth(recording))
        if within_tank(recording) and upright(recording):
            return recording
    raise RuntimeError(f"{case.truth.tier} {case.truth.seed}: no plausible run {index} was found")


def draw_run(case: Experiment, index: int):
    """A function that swims one drawn schedule from a given start depth."""
    plan, disturbance = case.plan, case.truth.disturbance
    rng = case.streams[0]
    style = ("steps", "waves")[index % 2]
    commands = merged(exciting(plan.rate, plan.duration, style, rng))
    start = Start(
        position=(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(0.2, 1.2)),
        euler=(0.0, 0.0, rng.uniform(-math.pi, math.pi)),
    )
    push = draw_push(
        disturbance["colour"],
        disturbance["force"],
        disturbance["time_constant"],
        disturbance["inertial"],
        (0.0, plan.duration * 1.1),
        case.streams[1],
    )

    def swim(depth: float | None) -> Recording:
        position = (*start.position[:2], start.position[2] if depth is None else depth)
        return swim_open_loop(case, commands, replace(start, position=position), push)

    return swim


def swim_open_loop(case: Experiment, commands: np.ndarray, start: Start, push: Push) -> Recording:
    """A run whose commands were chosen beforehand."""
    plan = case.plan
    times = np.arange(round(plan.duration * plan.rate) + 1) / plan.rate
    when = np.maximum(true_times(times, case.effects), 0.0)
    swim = Swim(case.fish.values(), case.effects, start, push)
    swim.command(commands)
    unique, back = np.unique(when, return_inverse=True)
    states = swim.run(float(unique[-1]), unique)[back]
    return Recording(times, distorted(channels_of(states), case.effects), commands, start, states)


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
    """Adds noise and writes the dataset."""
    truth, recordings = recorded
    rng = case.streams[2]
    declared = bool(rng.integers(2))
    runs = tuple(
        measured_run(case.plan, truth, recording, f"r{index + 1:02d}", rng)
        for index, recording in enumerate(recordings)
    )
    noise = truth.noise if declared else {}
    write_dataset(Dataset(f"{truth.tier}-{truth.seed}", truth.fish, runs, noise), folder)
    return replace(truth, about={**truth.about, "noise_declared": declared})


def measured_run(
    plan: Plan, truth: Truth, recording: Recording, name: str, rng: np.random.Generator
) -> Run:
    """One run with noise, in the project's format."""
    channels = with_noise(recording.channels, truth.noise, rng)
    steps = CommandSteps(recording.commands[:, 0], recording.commands[:, 1:])
    known = plan.start == "rest"
    return Run.from_steps(
        name,
        recording.times,
        channels,
        steps,
        start=plan.start,
        tail_phase=recording.start.phase if known else None,
    )
