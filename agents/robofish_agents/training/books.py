"""Records of a training: times, evaluations and checkpoints.

Every engine keeps them in the same way. Checkpoints are written between two rollouts, after the
updates of the learner, so that a resumed training continues with the same bits.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import TrainConfig


class Watcher(Protocol):
    """Receives the progress of a training."""

    def stepped(self, steps: int) -> object:
        """Receives the number of control steps so far."""

    def evaluated(self, row: dict[str, float]) -> object:
        """Receives an evaluation."""


class Quiet:
    """Ignores the progress of a training."""

    def stepped(self, steps: int) -> None:
        """Ignores steps."""

    def evaluated(self, row: dict[str, float]) -> None:
        """Ignores evaluations."""


class Books:
    """Records a training.

    Args:
        config: the training.
        progress: what was done before; kept up to date.
        watcher: receives steps and evaluations.
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
        """Evaluates the result of the imitation, before the first rollout."""
        if self.config.imitate.rounds and not self.progress.evaluations:
            self.evaluate()

    def before_rollout(self, steps: int, ready: bool = True) -> None:
        """Evaluates and saves if it is due after this number of control steps.

        Args:
            steps: control steps of all fish so far.
            ready: whether the policy has begun to learn; otherwise it is not evaluated.
        """
        self._count()
        self.progress.steps = steps
        if ready and self._due(self.config.evaluation.every, self._evaluated_at()):
            self.evaluate()
        if self._due(self.config.checkpoint_every, self._saved_at):
            self._save()
            self._saved_at = steps
        self._rollout_from = time.process_time()

    def stepped(self, steps: int) -> None:
        """Passes on the number of control steps so far."""
        self.watcher.stepped(steps)

    def after_rollout(self) -> None:
        """Counts the time of a rollout."""
        self.progress.rollout_cpu_s += time.process_time() - self._rollout_from

    def end(self, steps: int) -> None:
        """Makes the last evaluation and checkpoint, after the last update."""
        self._count()
        self.progress.steps = steps
        if self._evaluated_at() < steps:
            self.evaluate()
        self._save()

    def evaluate(self) -> None:
        """Evaluates; this time is not counted as training."""
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
