"""Train, evaluate and diagnose in turn in one process, and watch what it holds."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fish_env.diagnosis import diagnose
from robofish_agents.evaluation.results import evaluate, write_results
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.registry import load_agents
from robofish_agents.training.books import Quiet
from robofish_agents.training.config import Evaluation, Ppo, TrainConfig
from robofish_agents.training.run import train
from scripts.reliability import watch
from tests.diagnosis.small_cases import small_case

TRAINING = TrainConfig(
    "soak", "ppo", "hold", 2048, num_envs=8, disturbances=("calm", "noisy"),
    ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1),
    evaluation=Evaluation(every=1000, episodes=2), checkpoint_every=1000,
)  # fmt: skip
EPISODES = 4
LEAST_TURNS = 6
"""So many turns are taken however little time is given: fewer could show no growth."""


def one_turn(folder: Path, data: Path) -> None:
    """Trains a policy, evaluates it and a controller, and diagnoses runs, into a folder.

    Args:
        folder: empty.
        data: measured runs.
    """
    policy = train(TRAINING, folder / "train", Quiet()).policy
    suite = load_suite("hard")
    for name in (str(policy), "pid"):
        result = evaluate(name, load_agents(name, "hold"), suite, "hold", EPISODES)
        write_results(folder / f"{Path(name).stem}.json", [result])
    diagnose(data, folder / "diagnosis", quick=True)


def take_turns(
    place: Path,
    seconds: float,
    seed: int = 0,
    say: Callable[[str], object] = lambda line: None,
    turn: Callable[[Path, Path], None] = one_turn,
    stopped: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Takes turns until the time is over, each in a folder of its own that is removed.

    Args:
        place: an empty folder; files in it, and in the folder for temporary files that belongs
            to it, are counted after each turn.
        seconds: how long; the last turn is finished.
        seed: of the runs that are diagnosed.
        say: told how each turn went.
        turn: what a turn does.
        stopped: asked after each turn; True ends the turns.

    Returns:
        Turns, seconds, and what the process held after each.
    """
    data, spare = place / "data", place / "temporary"
    small_case(data, {}, runs=3, duration=4.0, seed=seed)
    spare.mkdir()
    before, tempfile.tempdir = tempfile.tempdir, str(spare)
    samples, lasted, begun = [], [], time.monotonic()
    try:
        while not stopped() and (time.monotonic() - begun < seconds or len(samples) < LEAST_TURNS):
            started, folder = time.monotonic(), place / "turn"
            turn(folder, data)
            shutil.rmtree(folder, ignore_errors=True)
            lasted.append(round(time.monotonic() - started, 2))
            samples.append(watch.sample(time.monotonic() - begun, [place]))
            say(f"turn {len(samples)}: {lasted[-1]:.1f} s, {samples[-1]}")
    finally:
        tempfile.tempdir = before
    return {
        "turns": len(samples),
        "hours": round((time.monotonic() - begun) / 3600.0, 4),
        "seconds_of_a_turn": {"shortest": min(lasted), "longest": max(lasted)},
        "resources": watch.summary(samples),
    }
