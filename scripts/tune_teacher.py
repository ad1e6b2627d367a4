"""Tunes the teacher of a training and prints the gains for its configuration.

    python -m scripts.tune_teacher ppo-track --generations 100 > gains.yaml

Candidates of an evolution strategy (CMA-ES) swim side by side, each the same episodes; seeds are
none of the suites', the trainings' or the evaluations on the side. Some of the episodes are picked
for being difficult: those that the gains to begin with, or the PID controller, hold barely or not.
Maximised is success, made smooth and with margins for the learner to lose, less depth and heading
errors and power; power beyond that of the PID controller on the same episodes costs dearly.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cma
import numpy as np
import numpy.typing as npt
import yaml

from fish_env.arrays import FloatArray, IntArray
from robofish_agents.controllers import PIDController
from robofish_agents.evaluation.suites import RESERVED_SEEDS, load_suite
from robofish_agents.training.config import load_train_config
from robofish_agents.training.teacher import LIFT, MOMENT, ForesightPID, beyond, true_observations
from robofish_agents.training.teacher_gains import TEACHER_GAIN_NAMES, TeacherGains, teacher_gains
from scripts.tune_pid import BOUNDS

FIRST_SEED, CHECK_SEED = 6_000_000, 7_000_000
"""Of the episodes that are tuned on, and of those that the result is checked on."""
assert not {FIRST_SEED, CHECK_SEED} & set(RESERVED_SEEDS)
ALL_BOUNDS = BOUNDS | {
    "depth": (0.2, 3.0),
    "pitch_error": (-1.0, 4.0),
    "speed_for_climb": (0.0, 0.1),
    "roll": (-2.5, 0.5),
    "depth_ahead": (0.0, 3.0),
    "climb_ahead": (0.0, 3.5),
    "turn_ahead": (0.0, 1.5),
    "trim_moment": (-3000.0, 3000.0),
    "trim_lift": (-1000.0, 1000.0),
    "hurry": (0.005, 0.018),
    "saving": (0.0, 0.006),
    "swing_from": (0.015, 0.05),
    "swing_speed": (0.0, 2.0),
    "turn_from": (0.02, 0.5),
    "turn_range": (0.05, 0.6),
    "turn_speed": (0.0, 0.06),
    "far_from": (0.02, 0.15),
    "far_speed": (0.0, 1.0),
    "far_limit": (0.01, 0.06),
}
LOW, HIGH = np.array([ALL_BOUNDS[name] for name in TEACHER_GAIN_NAMES]).T


@dataclass(frozen=True)
class Aim:
    """What is maximised for a task.

    Attributes:
        sets: suite, task, episodes, whether they are picked for being difficult, weight.
        margins: largest late errors of depth (m), heading (rad) and speed (m/s) that count as
            success, less than the environment's, and how softly.
        weights: of success, of rms errors of depth (per m) and heading (per degree), of power
            (per W).
    """

    sets: tuple[tuple[str, str, int, bool, float], ...]
    margins: tuple[tuple[float, float], ...]
    weights: tuple[float, float, float, float]


AIMS = {
    "track": Aim(
        (
            ("hard", "track", 44, True, 0.30),
            ("calm", "track", 14, True, 0.12),
            ("hard", "track", 24, False, 0.20),
            ("calm", "hold", 12, False, 0.12),
            ("hard", "hold", 12, False, 0.13),
            ("hard", "hold", 20, True, 0.13),
        ),
        ((0.044, 0.004), (0.065, 0.007), (0.018, 0.0007)),
        (1.0, 10.0, 0.04, 3.0),
    ),
    "hold": Aim(
        (
            ("hard", "hold", 28, False, 0.45),
            ("calm", "hold", 24, False, 0.35),
            ("hard", "hold", 14, True, 0.20),
        ),
        ((0.030, 0.004), (0.040, 0.006), (0.017, 0.0007)),
        (0.5, 30.0, 0.06, 1.5),
    ),
}


class Scores(NamedTuple):
    """Of each fish (N,): largest late errors (m, rad, m/s), rms errors, power (W), success."""

    late: FloatArray
    depth: FloatArray
    heading: FloatArray
    power: FloatArray
    success: FloatArray


class Trial:
    """Episodes of one suite and task for many candidates side by side."""

    def __init__(self, suite: str, task: str, seeds: IntArray, candidates: int) -> None:
        given = load_suite(suite)
        self.env = given.make(task, candidates * len(seeds), 1)
        self.steps, self.shape = given.episode_steps, (candidates, len(seeds))
        self.seeds = np.tile(seeds, candidates).tolist()

    def teacher(self, gains: FloatArray) -> Scores:
        """Of gains (candidates, names)."""
        lanes = np.repeat(gains, self.shape[1], axis=0).T
        pid = ForesightPID(TeacherGains(**dict(zip(TEACHER_GAIN_NAMES, lanes, strict=True))))
        batch = self.env.batch

        def begin() -> None:
            pid.reset(batch.count)
            pid.trim(beyond(MOMENT, batch), beyond(LIFT, batch))

        return self.swim(begin, lambda seen: pid.act(true_observations(seen, batch)))

    def pid(self) -> Scores:
        """Of the PID controller."""
        pid = PIDController()
        return self.swim(lambda: pid.reset(self.env.num_envs), pid.act)

    def swim(self, begin: Callable[[], None], act: Callable[..., npt.ArrayLike]) -> Scores:
        """Of whatever acts on observations."""
        observations, _ = self.env.reset(seed=self.seeds)
        begin()
        alive = np.ones(self.env.num_envs, bool)
        kept: dict[str, list[FloatArray]] = {"depth": [], "heading": [], "speed": []}
        power = np.zeros(self.env.num_envs)
        for _ in range(self.steps):
            observations, _, terminated, _, info = self.env.step(act(observations))
            for name, values in kept.items():
                values.append(np.abs(info[f"{name}_error"]))
            power += info["power"] / self.steps
            alive &= ~terminated
        series = {name: np.array(values) for name, values in kept.items()}
        late = np.stack([values[-100:].max(axis=0) for values in series.values()])
        rms = {name: np.sqrt(np.mean(values**2, axis=0)) for name, values in series.items()}
        late = np.where(alive, late, np.inf)
        return Scores(late, rms["depth"], rms["heading"], power, info["is_success"] * alive)


def merit(aim: Aim, trial: Trial, gains: FloatArray, allowed_w: float) -> FloatArray:
    """To be maximised, (candidates,)."""
    scores = trial.teacher(gains)
    soft = np.ones(len(scores.power))
    for late, (limit, width) in zip(scores.late, aim.margins, strict=True):
        soft /= 1.0 + np.exp(np.clip((late - limit) / width, -30.0, 30.0))
    success, depth, heading, power = aim.weights
    each = success * soft - depth * scores.depth - power * scores.power
    each -= heading * np.degrees(scores.heading)
    used = scores.power.reshape(trial.shape).mean(axis=1)
    means = each.reshape(trial.shape).mean(axis=1)
    return np.asarray(means - 20.0 * np.maximum(used - allowed_w, 0.0))


def difficult(suite: str, task: str, first: int, count: int, gains: FloatArray) -> IntArray:
    """Seeds of episodes that are held barely or not."""
    trial = Trial(suite, task, np.arange(first, first + 40 * count), 1)
    both = [trial.teacher(gains[None])] + ([trial.pid()] if task == "hold" else [])
    limits = np.array([0.025, 0.05, 0.017])[:, None]
    if task == "hold":
        barely = np.any([scores.success == 0.0 for scores in both], axis=0)
    else:
        barely = (both[0].late > limits).any(axis=0)
    return first + np.flatnonzero(barely)[:count]


def evolve(
    merits: Callable[[FloatArray], FloatArray], start: FloatArray, sigma: float, generations: int,
    candidates: int, seed: int,
) -> Iterator[tuple[FloatArray, float]]:  # fmt: skip
    """CMA-ES in the unit cube: what it takes for the best, and its candidates' best merit.

    By pycma, the reference implementation of the method's author, which knows how to keep to
    bounds.
    """
    options = {"popsize": candidates, "bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9}
    search = cma.CMAEvolutionStrategy(start, sigma, options)
    for _ in range(generations):
        points = search.ask()
        found = merits(np.array(points))
        search.tell(points, (-found).tolist())
        yield np.clip(search.result.xfavorite, 0.0, 1.0), float(found.max())


def tune(aim: Aim, start: FloatArray, options: argparse.Namespace) -> FloatArray:
    swims = []
    for i, (suite, task, count, picked, weight) in enumerate(aim.sets):
        first = FIRST_SEED + 100_000 * i
        seeds = np.arange(first, first + count)
        if picked:
            seeds = difficult(suite, task, first, count, start)
        allowed = 0.96 * float(Trial(suite, task, seeds, 1).pid().power.mean())
        swims.append((Trial(suite, task, seeds, options.candidates), weight, allowed))

    def merits(points: FloatArray) -> FloatArray:
        gains = LOW + (HIGH - LOW) * points
        return np.sum([weight * merit(aim, trial, gains, w) for trial, weight, w in swims], axis=0)

    first_point = np.clip((start - LOW) / (HIGH - LOW), 0.0, 1.0)
    means = [first_point]
    search = evolve(
        merits, first_point, options.spread, options.generations, options.candidates, options.seed
    )
    for mean, value in search:
        print(f"generation {len(means)}: {value:.4f}", file=sys.stderr)
        means.append(mean)
    return np.asarray(LOW + (HIGH - LOW) * means[-1])


def check(task: str, gains: FloatArray, episodes: int) -> None:
    """Says how gains do on episodes that were not tuned on."""
    for suite in ("calm", "current", "noisy", "hard"):
        trial = Trial(suite, task, np.arange(CHECK_SEED, CHECK_SEED + episodes), 1)
        for name, scores in (("teacher", trial.teacher(gains[None])), ("pid", trial.pid())):
            print(
                f"{suite} {task} {name}: success {scores.success.mean():.3f}, "
                f"{100 * scores.depth.mean():.2f} cm, "
                f"{np.degrees(scores.heading.mean()):.2f} degrees, "
                f"{1000 * scores.power.mean():.1f} mW",
                file=sys.stderr,
            )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    add = parser.add_argument
    add("training", help="a shipped training, or its file: begin with its teacher")
    add("--generations", type=int, default=100)
    add("--candidates", type=int, default=32)
    add("--check", type=int, default=500, help="episodes that the result is checked on")
    add("--seed", type=int, default=0, help="of the search")
    add("--spread", type=float, default=0.05, help="of the first candidates, share of the bounds")
    options = parser.parse_args(arguments)
    config = load_train_config(options.training)
    known = teacher_gains(config.imitate.gains)
    start = np.array([getattr(known, name) for name in TEACHER_GAIN_NAMES], float)
    found = tune(AIMS[config.task], start, options)
    values = {n: float(f"{x:.4g}") for n, x in zip(TEACHER_GAIN_NAMES, found, strict=True)}
    yaml.safe_dump({"gains": values}, sys.stdout, sort_keys=False)
    check(config.task, found, options.check)


if __name__ == "__main__":
    main()
