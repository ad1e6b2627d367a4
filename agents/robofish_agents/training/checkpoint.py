"""Checkpoints: one file from which a later process continues with the same bits.

It is written beside the old one and put in its place at once, so that a kill at any moment leaves
a whole file, and a checksum tells a damaged one. It holds arrays and JSON and no pickles, so that
reading one can run no code.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fish_env.archives import UNREADABLE
from fish_env.errors import ConfigError
from fish_env.reading import is_number, shown, words_of
from fish_env.version import WRITER
from robofish_agents.training.config import DEFAULT_ENGINE, TrainConfig
from robofish_agents.training.plain import read_plain, write_plain
from robofish_agents.training.stack import Stack

FORMAT = "robofish-checkpoint-3"
KEYS = ("steps", "success_rate", "episode_return")
"""What each evaluation has, of its numbers those that the training compares."""
LONGEST_REASON = 200


@dataclass
class Progress:
    """Progress of a training, over all its processes.

    Attributes:
        steps: control steps of all fish.
        cpu_s: processor time of training, without evaluations (s).
        wall_s: elapsed time of the same (s).
        imitation_cpu_s: part of it spent in imitation, before learning (s).
        rollout_cpu_s: part of it spent in collecting experience, environment included (s).
        env_cpu_s: part of that spent in the environment (s).
        evaluations: rows of the evaluations during training.
    """

    steps: int = 0
    cpu_s: float = 0.0
    wall_s: float = 0.0
    imitation_cpu_s: float = 0.0
    rollout_cpu_s: float = 0.0
    env_cpu_s: float = 0.0
    evaluations: tuple[dict[str, float], ...] = ()


def save_checkpoint(
    path: Path, config: TrainConfig, learner: dict[str, Any], stack: Stack, progress: Progress
) -> None:
    """Writes a checkpoint atomically: a killed process leaves the last one.

    Args:
        path: the file.
        config: of the training.
        learner: state of the learner, plain values.
        stack: its fish.
        progress: what was done so far.

    Raises:
        OutputError: the file cannot be written.
    """
    tree = {
        "format": FORMAT,
        "made_with": WRITER,
        "config": config.tree(),
        "learner": learner,
        "stack": stack.state(),
        "progress": asdict(progress),
    }
    write_plain(tree, path)


def load_checkpoint(
    path: Path, config: TrainConfig, stack: Stack, restore: Callable[[dict[str, Any]], None]
) -> Progress:
    """Reads the progress and restores fish, learner and all random generators.

    Args:
        path: the file. Reading it runs no code, whatever it holds.
        config: of the training that goes on.
        stack: fish of that configuration.
        restore: restores the learner, after the fish.

    Raises:
        ConfigError: not a checkpoint, a damaged one, or one of another configuration or version.
    """
    try:
        tree = read_plain(path)
        if tree["format"] != FORMAT:
            raise ValueError(f"its format is {tree['format']!r}, not {FORMAT!r}")
        saved = tree["config"]
        _check_same(path, saved, config.tree())
        stack.restore(tree["stack"])
        restore(tree["learner"])
        progress = _progress(tree["progress"], config)
    except (*UNREADABLE, TypeError, AttributeError, IndexError) as error:
        why = words_of(error, LONGEST_REASON)
        reason = _earlier(path) or f"not a readable checkpoint ({why})"
        raise ConfigError(
            f"{path}: {reason}; move it away to start again, or train into another folder"
        ) from None
    return progress


def _progress(saved: dict[str, Any], config: TrainConfig) -> Progress:
    """The progress that a checkpoint names.

    Raises:
        ValueError, TypeError, KeyError: it is none of this training.
    """
    rows = saved.pop("evaluations")
    wrong = [name for name, value in saved.items() if not is_number(value) or value < 0]
    if wrong or not isinstance(saved["steps"], int):
        raise ValueError(f"its progress has wrong {shown(wrong or ['steps'])}")
    if not isinstance(rows, list) or not all(is_number(row[key]) for row in rows for key in KEYS):
        raise ValueError(f"its evaluations lack {', '.join(KEYS)}")
    if not rows and saved["steps"] >= config.total_steps:
        raise ValueError("it is finished and has no evaluations")
    return Progress(**saved, evaluations=tuple(rows))


def _earlier(path: Path) -> str | None:
    """Returns the message for a checkpoint of the first format, which held pickles."""
    try:
        with zipfile.ZipFile(path) as archive:
            first = archive.read("format")
    except UNREADABLE:
        return None
    if first != b"robofish-checkpoint-1":
        return None
    return "written by an earlier version in a form that could run code; such files are refused"


def _check_same(path: Path, saved: dict[str, Any], now: dict[str, Any]) -> None:
    was, now = {"engine": DEFAULT_ENGINE} | saved, {"engine": DEFAULT_ENGINE} | now
    changed = [key for key in now if was.get(key) != now[key]]
    if changed:
        words = "; ".join(
            f"{key} was {shown(was.get(key))}, is {shown(now[key])}" for key in changed
        )
        raise ConfigError(
            f"{path}: of another configuration ({words}); resume with the same one, or train into "
            "another folder"
        )
