"""One training from its configuration to a policy file, in one process or several."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import torch
import yaml

from fish_env.errors import ConfigError
from fish_env.files import check_no_links, write_bytes, write_rows
from fish_env.version import stamped
from robofish_agents.policies.files import write_policy
from robofish_agents.policies.pretrained import PretrainedPolicy
from robofish_agents.training.books import Books, Watcher
from robofish_agents.training.card import card, shares
from robofish_agents.training.checkpoint import Progress, load_checkpoint, save_checkpoint
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.engines import Engine, make_engine
from robofish_agents.training.lock import locked
from robofish_agents.training.stack import Stack, make_stack, seed_episodes
from robofish_agents.training.trial import try_policy

CHECKPOINT = "checkpoint.zip"
POLICY = "policy.npz"
CONFIG, CARD, EVALUATIONS = "config.yaml", "card.yaml", "evaluations.csv"


@dataclass(frozen=True)
class Outcome:
    """Result of a training.

    Attributes:
        policy: file of the policy with the best evaluation during training.
        best: row of that evaluation.
        progress: steps, times and all evaluations.
    """

    policy: Path
    best: dict[str, float]
    progress: Progress


def train(config: TrainConfig, folder: Path, watcher: Watcher, resume: bool = False) -> Outcome:
    """Trains, and writes all files into a folder.

    The folder gets ``policy.npz`` and ``card.yaml`` (best so far), ``checkpoint.zip``,
    ``evaluations.csv``, ``config.yaml`` and ``tensorboard/``. A training that was stopped at any
    moment and resumed takes the same steps, to the bit, as one that was not.

    Args:
        config: what to train.
        folder: made if missing.
        watcher: receives steps and evaluations.
        resume: go on from the folder's checkpoint; from the start, if it was stopped before the
            first one.

    Raises:
        ConfigError: the folder has a checkpoint and ``resume`` is False, or one that does not fit;
            another process trains in it; or it has files of the same names that this training did
            not write. The folder then stays as it was.
        OutputError: the folder cannot be written.
    """
    with locked(folder), _torch_threads(config.threads.torch):
        _check_folder(config, folder, resume)
        run = _Run(config, folder)
        try:
            return run.finish(watcher)
        finally:
            run.engine.close()


def outputs(folder: Path) -> list[Path]:
    """Lists the files that a training writes into a folder, beside its log."""
    return [folder / name for name in (CONFIG, CHECKPOINT, POLICY, CARD, EVALUATIONS)]


def config_bytes(config: TrainConfig) -> bytes:
    """What ``config.yaml`` of a run folder holds."""
    return stamped(_yaml(config.tree()).decode("utf-8")).encode("utf-8")


def holds_config(file: Path, config: TrainConfig) -> bool:
    """Whether a run folder's ``config.yaml`` is of this configuration, by whatever version.

    Args:
        file: the file.
        config: the configuration.
    """
    if not file.is_file():
        return False
    lines = file.read_bytes().splitlines(keepends=True)
    return b"".join(x for x in lines if not x.startswith(b"#")) == _yaml(config.tree())


def best_of(evaluations: Sequence[dict[str, float]]) -> dict[str, float]:
    """The evaluation whose policy is kept: the first of those with the most success."""
    return max(evaluations, key=_merit)


def _check_folder(config: TrainConfig, folder: Path, resume: bool) -> None:
    """Refuses a folder with files that would be replaced."""
    check_no_links(outputs(folder))
    if (folder / CHECKPOINT).exists():
        if not resume:
            raise ConfigError(
                f"{folder}: a training is kept here already; add --resume to continue it, or "
                "give another folder with --out"
            )
        return
    present = [file for file in outputs(folder) if file.exists()]
    if present and not holds_config(folder / CONFIG, config):
        raise ConfigError(
            f"{present[0]}: this training did not write it and would replace it; move it away, or "
            "give another folder with --out"
        )


class _Run:
    """A training with its folder."""

    def __init__(self, config: TrainConfig, folder: Path) -> None:
        self.config, self.folder = config, folder
        self.stack: Stack = make_stack(config)
        self.engine: Engine = make_engine(config, self.stack)
        checkpoint = folder / CHECKPOINT
        if checkpoint.exists():
            self.progress = load_checkpoint(checkpoint, config, self.stack, self.engine.restore)
        else:
            write_bytes(folder / CONFIG, config_bytes(config))
            self.progress = Progress()
            seed_episodes(self.stack, config)
            if config.imitate.rounds:
                self._imitate()

    def _imitate(self) -> None:
        cpu, wall = time.process_time(), time.perf_counter()
        self.engine.imitate()
        self.progress.imitation_cpu_s = time.process_time() - cpu
        self.progress.cpu_s += self.progress.imitation_cpu_s
        self.progress.wall_s += time.perf_counter() - wall
        self.stack.fish.cpu_s = 0.0

    def finish(self, watcher: Watcher) -> Outcome:
        config, progress = self.config, self.progress
        if progress.steps < config.total_steps:
            self.record = self.engine.log_to(self.folder / "tensorboard")
            evaluate, save = self._evaluate, self._save
            self.engine.learn(Books(config, progress, watcher, evaluate, save, self.record))
        return Outcome(self.folder / POLICY, best_of(progress.evaluations), progress)

    def _evaluate(self) -> dict[str, float]:
        row = try_policy(self.config, PretrainedPolicy(self.engine.policy({})))
        if all(_merit(row) > _merit(other) for other in self.progress.evaluations):
            self._keep(row)
        return row

    def _keep(self, row: dict[str, float]) -> None:
        about = card(self.config, self.progress, row)
        write_policy(self.engine.policy(about), self.folder / POLICY)
        write_bytes(self.folder / CARD, _yaml(about))

    def _save(self) -> None:
        for name, share in shares(self.progress, self.stack.fish.cpu_s).items():
            self.record(f"time/share_{name}", share)
        self.progress.env_cpu_s = self.stack.fish.cpu_s
        learner = self.engine.state()
        save_checkpoint(self.folder / CHECKPOINT, self.config, learner, self.stack, self.progress)
        rows = self.progress.evaluations
        if rows:
            write_rows(self.folder / EVALUATIONS, list(rows[0]), rows)


def _merit(row: dict[str, float]) -> tuple[float, float]:
    return row["success_rate"], row["episode_return"]


def _yaml(tree: dict[str, object]) -> bytes:
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True).encode()


@contextmanager
def _torch_threads(count: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
