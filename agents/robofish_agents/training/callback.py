"""A callback of Stable-Baselines3 that reports rollouts to the records of a training."""

from __future__ import annotations

from stable_baselines3.common.callbacks import BaseCallback

from robofish_agents.training.books import Books


class Between(BaseCallback):
    """Passes events of the learner to the records.

    Args:
        books: of the training.
    """

    def __init__(self, books: Books) -> None:
        super().__init__()
        self.books = books

    def _on_training_start(self) -> None:
        self.books.begin()

    def _on_rollout_start(self) -> None:
        self.books.before_rollout(self.num_timesteps)

    def _on_rollout_end(self) -> None:
        self.books.after_rollout()

    def _on_step(self) -> bool:
        self.books.stepped(self.num_timesteps)
        return True

    def _on_training_end(self) -> None:
        self.books.end(self.num_timesteps)
