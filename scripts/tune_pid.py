"""Tunes the gains of the PID controller and writes configs/controllers/pid.yaml.

    python -m scripts.tune_pid --generations 60

All candidates swim side by side, each the same episodes; seeds are none of the suites'. Maximised
is the mean of success and of return per step, over both tasks of the suites `calm` and `hard`:
what must be held exactly, and what must be held in spite of everything.
"""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml
from rich.console import Console
from rich.progress import Progress
from scipy.optimize import differential_evolution

from fish_env.arrays import FloatArray
from fish_env.envs.tasks import SIGNAL_TASKS
from robofish_agents.controllers.pid import GAIN_NAMES, PIDController, PIDGains, load_gains
from robofish_agents.evaluation.suites import RESERVED_SEEDS, Suite, load_suite

FILE = Path(__file__).resolve().parents[1] / "configs" / "controllers" / "pid.yaml"
SUITES = ("calm", "hard")
FIRST_SEED, CHECK_SEED = 3_000_000, 3_500_000
"""Of the episodes that are tuned on, and of those that the result is checked on."""
assert FIRST_SEED not in RESERVED_SEEDS
assert CHECK_SEED not in RESERVED_SEEDS
BOUNDS = {
    "depth": (0.05, 2.0),
    "depth_integral": (0.0, 1.5),
    "depth_windup": (0.1, 1.0),
    "climb_limit": (0.02, 0.12),
    "climb_damping": (0.0, 3.0),
    "pitch": (0.0, 16.0),
    "pitch_error": (0.0, 4.0),
    "pitch_rate": (0.0, 3.0),
    "heading": (0.3, 10.0),
    "heading_rate": (0.0, 2.0),
    "heading_feedforward": (0.0, 6.0),
    "heading_integral": (0.0, 1.0),
    "frequency": (-0.6, 1.0),
    "speed": (0.0, 30.0),
    "speed_integral": (0.0, 8.0),
    "speed_for_climb": (0.0, 0.05),
    "amplitude": (-0.3, 1.0),
    "roll": (-2.0, 2.0),
}


class Trial:
    """Episodes of one suite and task, for many candidates side by side."""

    def __init__(self, suite: Suite, task: str, candidates: int, episodes: int, seed: int) -> None:
        self.env = suite.make(task, candidates * episodes)
        self.steps = suite.episode_steps
        self.shape = (candidates, episodes)
        self.seeds = np.tile(np.arange(seed, seed + episodes), candidates).tolist()

    def scores(self, gains: FloatArray) -> FloatArray:
        """Success and return per step, (2, candidates), of gains (names, candidates)."""
        lanes = np.repeat(gains, self.shape[1], axis=1)
        agent = PIDController(PIDGains(**dict(zip(GAIN_NAMES, lanes, strict=True))))
        observations, _ = self.env.reset(seed=self.seeds)
        agent.reset(self.env.num_envs)
        alive = np.ones(self.env.num_envs, bool)
        total = np.zeros(self.env.num_envs)
        for _ in range(self.steps):
            observations, reward, terminated, truncated, info = self.env.step(
                agent.act(observations)
            )
            total += np.where(alive, reward, 0.0)
            success = np.where(alive, info["is_success"], 0.0)
            alive &= ~(terminated | truncated)
        means = [values.reshape(self.shape).mean(axis=1) for values in (success, total)]
        return np.stack([means[0], means[1] / self.steps])


def trials(candidates: int, episodes: int, seed: int) -> dict[str, Trial]:
    return {
        f"{name} {task}": Trial(load_suite(name), task, candidates, episodes, seed)
        for name in SUITES
        for task in SIGNAL_TASKS
    }


def tune(starts: FloatArray, options: argparse.Namespace, console: Console) -> FloatArray:
    """Gains found by differential evolution that begins at and between known ones."""
    low, high = np.array([BOUNDS[name] for name in GAIN_NAMES]).T
    rng = np.random.default_rng(options.seed)
    count = len(starts)
    shares = np.vstack([np.eye(count), rng.dirichlet(np.ones(count), options.candidates - count)])
    noise = rng.standard_normal((options.candidates, len(low)))
    noise[:count] = 0.0
    first = np.clip(shares @ starts + options.spread * (high - low) * noise, low, high)
    swims = trials(options.candidates, options.episodes, FIRST_SEED)
    with Progress(console=console) as progress:
        bar = progress.add_task("tuning", total=options.generations + 1)

        def cost(gains: FloatArray) -> FloatArray:
            scores = np.mean([trial.scores(gains).sum(axis=0) for trial in swims.values()], axis=0)
            progress.update(bar, advance=1, description=f"best {scores.max():.4f}")
            return -scores

        found = differential_evolution(
            cost, list(zip(low, high, strict=True)), init=first, maxiter=options.generations,
            vectorized=True, updating="deferred", polish=False, tol=0.0, rng=rng,
            mutation=(0.3, 0.9), recombination=0.8,
        )  # fmt: skip
    return np.asarray(found.x)


def check(columns: dict[str, FloatArray], episodes: int, console: Console) -> None:
    """Prints scores on episodes that were not tuned on."""
    gains = np.stack(list(columns.values()), axis=1)
    for name, trial in trials(len(columns), episodes, CHECK_SEED).items():
        success, reward = trial.scores(gains)
        for label, s, r in zip(columns, success, reward, strict=True):
            console.print(f"{name:12} {label:30} success {s:.3f}  return per step {r:.4f}")


def write(gains: FloatArray, options: argparse.Namespace, file: Path) -> None:
    values = {name: float(f"{x:.4g}") for name, x in zip(GAIN_NAMES, gains, strict=True)}
    head = (
        f"# Written by scripts/tune_pid.py on {datetime.date.today()}: {options.generations} "
        f"generations of {options.candidates} candidates,\n# {options.episodes} episodes each of "
        f"{' and '.join(SUITES)}, both tasks, seeds from {FIRST_SEED}. Units: see PIDGains.\n"
    )
    body = yaml.safe_dump({"gains": values}, sort_keys=False)
    file.write_text(head + body, encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--generations", type=int, default=60)
    add("--candidates", type=int, default=64)
    add("--episodes", type=int, default=16, help="of each suite and task, for each candidate")
    add("--check", type=int, default=200, help="episodes each that the result is checked on")
    add("--seed", type=int, default=0, help="of the search")
    add("--start", type=Path, nargs="+", default=[FILE], help="gains to begin with")
    add("--spread", type=float, default=0.1, help="of the first candidates, share of the bounds")
    add("--out", type=Path, default=FILE)
    options, console = parser.parse_args(arguments), Console()
    known = [load_gains(file) for file in options.start]
    starts = np.array([[getattr(gains, name) for name in GAIN_NAMES] for gains in known], float)
    found = tune(starts, options, console)
    write(found, options, options.out)
    before = {str(file): start for file, start in zip(options.start, starts, strict=True)}
    check(before | {"tuned": found}, options.check, console)
    console.print(f"written: {options.out}")


if __name__ == "__main__":
    main()
