"""A training's books: time is counted, policies are evaluated, checkpoints are written.

Every engine keeps them alike: between two rollouts, when the learner has just finished its updates,
so that what is saved there can go on with the same bits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import TrainConfig


class Watcher(Protocol):
    """What a training tells about itself."""

    def stepped(self, steps: int) -> object:
        """So many control steps are done."""

    def evaluated(self, row: dict[str, float]) -> object:
        """An evaluation on the side is done."""


class Quiet:
    """Watches a training and says nothing."""

    def stepped(self, steps: int) -> None:
        """Steps are not shown."""

    def evaluated(self, row: dict[str, float]) -> None:
        """Neither are evaluations."""


class Books:
    """Keeps a training's books.

    Args:
        config: the training.
        progress: what was done before; kept up to date.
        watcher: told about steps and evaluations.
        evaluate: evaluates the present policy and keeps it if it is the best.
        save: writes a checkpoint.
        record: takes a name and a value for the log.
    """

    def __init__(
        self,
        config: TrainConfig,
        progress: Progress,
        watcher: Watcher,
        evaluate: Callable[[], dict[str, float]],
        save: Callable[[], None],
        record: Callable[[str, float], object],
    ) -> None:
        self.config, self.progress, self.watcher = config, progress, watcher
        self._evaluate, self._save, self._record = evaluate, save, record
        self._saved_at = progress.steps
        self._now()
        self._rollout_from = self._cpu

    def begin(self) -> None:
        """Before the first rollout: what imitation came to is evaluated."""
        if self.config.imitate.rounds and not self.progress.evaluations:
            self.evaluate()

    def before_rollout(self, steps: int) -> None:
        """Evaluates and saves where it is due, after so many control steps."""
        self._count()
        self.progress.steps = steps
        if self._due(self.config.evaluation.every, self._evaluated_at()):
            self.evaluate()
        if self._due(self.config.checkpoint_every, self._saved_at):
            self._save()
            self._saved_at = steps
        self._rollout_from = time.process_time()

    def stepped(self, steps: int) -> None:
        """A step of all fish is done, and so many in all."""
        self.watcher.stepped(steps)

    def after_rollout(self) -> None:
        """Experience is collected; updates follow."""
        self.progress.rollout_cpu_s += time.process_time() - self._rollout_from

    def end(self, steps: int) -> None:
        """After the last update: the last evaluation and checkpoint."""
        self._count()
        self.progress.steps = steps
        if self._evaluated_at() < steps:
            self.evaluate()
        self._save()

    def evaluate(self) -> None:
        """Evaluates on the side; the time that takes is not counted as training."""
        row = {"steps": float(self.progress.steps), "cpu_s": self.progress.cpu_s}
        row |= self._evaluate()
        self.progress.evaluations += (row,)
        for name, value in row.items():
            self._record(f"evaluation/{name}", value)
        self.watcher.evaluated(row)
        self._now()

    def _due(self, every: int, last: float) -> bool:
        return self.progress.steps // every > last // every

    def _evaluated_at(self) -> float:
        rows = self.progress.evaluations
        return rows[-1]["steps"] if rows else 0.0

    def _now(self) -> None:
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    def _count(self) -> None:
        cpu, wall = self._cpu, self._wall
        self._now()
        self.progress.cpu_s += self._cpu - cpu
        self.progress.wall_s += self._wall - wall
