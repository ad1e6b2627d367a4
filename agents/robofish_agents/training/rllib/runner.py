"""An environment runner of RLlib that steps the whole batch of fish at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from ray.rllib.core import COMPONENT_RL_MODULE, DEFAULT_AGENT_ID, DEFAULT_MODULE_ID
from ray.rllib.core.columns import Columns
from ray.rllib.env import INPUT_ENV_SINGLE_SPACES, INPUT_ENV_SPACES
from ray.rllib.env.env_runner import EnvRunner
from ray.rllib.env.single_agent_episode import SingleAgentEpisode
from ray.rllib.utils.metrics import (
    NUM_AGENT_STEPS_SAMPLED,
    NUM_ENV_STEPS_SAMPLED,
    NUM_ENV_STEPS_SAMPLED_LIFETIME,
)
from stable_baselines3.common.vec_env import VecNormalize

from robofish_agents.training.books import Books
from robofish_agents.training.rllib.module import FishModule
from robofish_agents.training.stack import Stack

Rows = npt.NDArray[Any]


class BatchRunner(EnvRunner):  # type: ignore[misc]
    """Runs all fish for one rollout and gives their trajectories to the learner.

    RLlib makes it from a configuration that it copies, so it gets its fish later, by :meth:`swim`.

    Attributes:
        env: the fish, as the learner sees them.
        rollout: control steps of each fish in one rollout.
        books: counts steps; None before the training begins.
        seen: (N, n) next input of the policy; None before the first reset.
        steps: control steps of all fish so far.
        ended: return, length and success of the episodes that ended in the last rollout.
    """

    env: VecNormalize
    rollout: int

    def __init__(self, *, config: Any, **kwargs: Any) -> None:
        super().__init__(config=config, **kwargs)
        self.books: Books | None = None
        self.seen: Rows | None = None
        self.steps = 0
        self.ended: list[tuple[float, float, float]] = []
        self.make_module()

    def swim(self, stack: Stack, rollout: int) -> None:
        """Sets the fish.

        Args:
            stack: the fish, with what is around them.
            rollout: control steps of each fish in one rollout.
        """
        self.env, self.rollout = stack.outside, rollout

    def make_module(self) -> None:
        """Makes the networks; RLlib copies the learner's weights into them."""
        spec = self.config.get_rl_module_spec(spaces=self.get_spaces())
        self.module: FishModule = spec.build()

    def assert_healthy(self) -> None:
        """Does nothing: fish and networks always exist."""

    def stop(self) -> None:
        """Does nothing: the training owns the fish."""

    def get_spaces(self) -> dict[str, Any]:
        """Returns the spaces of the input and of the action of the policy."""
        spaces = (self.config.observation_space, self.config.action_space)
        return dict.fromkeys((INPUT_ENV_SPACES, INPUT_ENV_SINGLE_SPACES, DEFAULT_MODULE_ID), spaces)

    def set_state(self, state: dict[str, Any]) -> None:
        """Takes the learner's weights."""
        if COMPONENT_RL_MODULE in state:
            weights = state[COMPONENT_RL_MODULE]
            self.module.set_state(weights.get(DEFAULT_MODULE_ID, weights))

    def get_state(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Returns the weights; the training keeps the state of the fish."""
        return {COMPONENT_RL_MODULE: self.module.get_state()}

    def get_metrics(self) -> Any:
        """Returns the counts since the last call."""
        return self.metrics.reduce()

    def sample(self, **kwargs: Any) -> list[SingleAgentEpisode]:
        """Returns one rollout of all fish, as parts of episodes."""
        if self.seen is None:
            self.seen = np.asarray(self.env.reset())
        self.ended.clear()
        rows = [self._step() for _ in range(self.rollout)]
        if self.books is not None:
            self.books.after_rollout()
        count = self.rollout * self.env.num_envs
        self.metrics.log_value(NUM_ENV_STEPS_SAMPLED, count, reduce="sum")
        self.metrics.log_value((NUM_AGENT_STEPS_SAMPLED, DEFAULT_AGENT_ID), count, reduce="sum")
        self.metrics.log_value(NUM_ENV_STEPS_SAMPLED_LIFETIME, count, reduce="lifetime_sum")
        lasts = [row.pop("last") for row in rows]
        whole = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
        lanes = range(self.env.num_envs)
        return [piece for lane in lanes for piece in self._pieces(lane, whole, lasts)]

    def _step(self) -> dict[str, Any]:
        """Takes one control step; returns inputs, actions and results, (N, ...) each."""
        seen = self.seen
        assert seen is not None
        with torch.no_grad():
            logits = self.module.forward_exploration({Columns.OBS: torch.as_tensor(seen)})[
                Columns.ACTION_DIST_INPUTS
            ]
            chances = self.module.get_exploration_action_dist_cls().from_logits(logits)
            action = chances.sample()
            likelihood = chances.logp(action)
        observed, reward, done, infos = self.env.step(np.clip(action.numpy(), -1.0, 1.0))
        self.seen = np.asarray(observed)
        last = {lane: infos[lane]["terminal_observation"] for lane in np.flatnonzero(done).tolist()}
        cut = np.zeros(len(done), bool)
        for lane in last:
            info = infos[lane]
            cut[lane] = info["TimeLimit.truncated"]
            episode = info["episode"]
            self.ended.append((episode["r"], episode["l"], float(info["is_success"])))
        self.steps += len(done)
        if self.books is not None:
            self.books.stepped(self.steps)
        return {
            "seen": seen, "action": action.numpy(), "logits": logits.numpy(),
            "likelihood": likelihood.numpy(), "reward": reward, "done": done, "cut": cut,
            "last": last,
        }  # fmt: skip

    def _pieces(
        self, lane: int, whole: dict[str, Rows], lasts: list[dict[int, Rows]]
    ) -> list[SingleAgentEpisode]:
        """The rollout of one fish, cut where episodes ended."""
        assert self.seen is not None
        ends = [int(step) + 1 for step in np.flatnonzero(whole["done"][:, lane])]
        if not ends or ends[-1] < self.rollout:
            ends.append(self.rollout)
        pieces = []
        for begin, end in zip([0, *ends], ends, strict=False):
            rows = {key: values[begin:end, lane] for key, values in whole.items()}
            done, cut = bool(rows["done"][-1]), bool(rows["cut"][-1])
            after = lasts[end - 1][lane] if done else self.seen[lane]
            piece = SingleAgentEpisode(
                observations=[*rows["seen"], after],
                actions=list(rows["action"]),
                rewards=list(rows["reward"]),
                infos=[{} for _ in range(end - begin + 1)],
                terminated=done and not cut,
                truncated=done and cut,
                extra_model_outputs={
                    Columns.ACTION_DIST_INPUTS: list(rows["logits"]),
                    Columns.ACTION_LOGP: list(rows["likelihood"]),
                },
                observation_space=self.env.observation_space,
                action_space=self.env.action_space,
                len_lookback_buffer=0,
            )
            pieces.append(piece.to_numpy())
        return pieces
