"""Checkpoints: one file with all that a later process needs to go on as if nothing had happened.

It is written beside the old one and put in its place at once, so that a kill at any moment leaves
a whole file. It contains pickles: it is for the machine that wrote it. What is given to others is
a policy file.
"""

from __future__ import annotations

import io
import pickle
import random
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml
from stable_baselines3 import PPO, SAC

from agents.policies.files import replace_file
from agents.training.config import TrainConfig
from agents.training.model import Model
from agents.training.stack import Stack
from fish_env.errors import ConfigError

FORMAT = "robofish-checkpoint-1"


@dataclass
class Progress:
    """What a training has done so far, over all the processes that worked on it.

    Attributes:
        steps: control steps of all fish.
        cpu_s: processor time of training, without evaluation on the side (s).
        wall_s: the same by the clock on the wall.
        imitation_cpu_s: part of it spent in imitation, before learning (s).
        rollout_cpu_s: part of it spent in collecting experience, environment included (s).
        env_cpu_s: part of that spent in the environment (s).
        evaluations: rows of the evaluations on the side.
    """

    steps: int = 0
    cpu_s: float = 0.0
    wall_s: float = 0.0
    imitation_cpu_s: float = 0.0
    rollout_cpu_s: float = 0.0
    env_cpu_s: float = 0.0
    evaluations: tuple[dict[str, float], ...] = ()


def save_checkpoint(
    path: Path, config: TrainConfig, model: Model, stack: Stack, progress: Progress
) -> None:
    """Writes a checkpoint; a kill leaves the last one."""
    learner = io.BytesIO()
    model.save(learner)
    state = {
        "stack": stack.state(),
        "progress": progress,
        "replay": getattr(model, "replay_buffer", None),
        "random": (torch.get_rng_state(), np.random.get_state(), random.getstate()),  # noqa: NPY002
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("format", FORMAT)
        archive.writestr("config.yaml", yaml.safe_dump(config.tree()))
        archive.writestr("learner.zip", learner.getvalue())
        archive.writestr("state.pkl", pickle.dumps(state))
    replace_file(path, buffer.getvalue())


def load_checkpoint(path: Path, config: TrainConfig, stack: Stack) -> tuple[Model, Progress]:
    """The learner and its progress; the stack and all random generators are put back.

    Raises:
        ConfigError: not a checkpoint, a damaged one, or one of another configuration.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        if parts.pop("format") != FORMAT.encode():
            raise KeyError("format")
        saved = yaml.safe_load(parts["config.yaml"])
        learner, content = io.BytesIO(parts["learner.zip"]), parts["state.pkl"]
    except (zipfile.BadZipFile, KeyError, EOFError) as error:
        raise ConfigError(
            f"{path}: not a readable checkpoint ({error}); remove it to start afresh"
        ) from None
    _check_same(path, saved, config.tree())
    state: dict[str, Any] = pickle.loads(content)
    kind = PPO if config.algorithm == "ppo" else SAC
    model: Model = kind.load(learner, env=stack.outside, device="cpu", force_reset=False)
    if state["replay"] is not None:
        assert isinstance(model, SAC)
        model.replay_buffer = state["replay"]
    stack.restore(state["stack"])
    torch_state, numpy_state, python_state = state["random"]
    torch.set_rng_state(torch_state)
    np.random.set_state(numpy_state)  # noqa: NPY002
    random.setstate(python_state)
    progress: Progress = state["progress"]
    return model, progress


def _check_same(path: Path, saved: dict[str, Any], now: dict[str, Any]) -> None:
    changed = [key for key in now if saved.get(key) != now[key]]
    if changed:
        words = "; ".join(f"{key} was {saved.get(key)!r}, is {now[key]!r}" for key in changed)
        raise ConfigError(
            f"{path}: of another configuration ({words}); resume with the same one, or train into "
            "another folder"
        )
