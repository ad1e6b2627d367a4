"""Training with PPO over tensors: a lean loop of PyTorch over the native batch.

The fish, their history and their normalisation are those of the other engines. Episodes of
different fish begin at different times, so that every rollout has all parts of an episode. The
critic may see the true state (:mod:`robofish_agents.training.privileged`).

With ``teacher`` a training has three phases. First a policy that sees the true state learns by PPO:
the teacher, which nobody made by hand. Then the policy proper swims, and is fitted to what the
teacher would have done (Lee et al., "Learning quadrupedal locomotion over challenging terrain",
Science Robotics 5, 2020). At last it goes on by PPO with the critic of the teacher.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common import logger
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.utils import set_random_seed
from torch import Tensor

from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from robofish_agents.policies.files import ACTIONS, PolicyFile
from robofish_agents.training.actor_critic import ActorCritic, Recipe, network_of
from robofish_agents.training.books import Books
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.forms import check_form, observations_of
from robofish_agents.training.learner_state import (
    optimiser_state,
    random_state,
    restore_optimiser,
    restore_random,
    weights_state,
    weights_tensors,
)
from robofish_agents.training.privileged import Sight
from robofish_agents.training.settings import LearningRate
from robofish_agents.training.stack import Stack
from robofish_agents.training.tensor_ppo import (
    LIMIT,
    Samples,
    Taken,
    follow,
    generalised,
    improve,
    staggered,
)


def recipe_of(config: TrainConfig) -> Recipe:
    """The settings of the policy's PPO as a recipe over tensors."""
    ppo, network = config.ppo, config.network
    return Recipe(
        steps=ppo.n_steps,
        epochs=ppo.n_epochs,
        minibatches=ppo.n_steps * config.num_envs // ppo.batch_size,
        learning_rate=ppo.learning_rate.start,
        gamma=ppo.gamma,
        trace=ppo.gae_lambda,
        clip=ppo.clip_range,
        layers=network.layers,
        log_std=network.log_std_init,
        log_std_end=network.log_std_end,
        critic_layers=config.critic.layers or None,
        activation=network.activation,
        entropy=ppo.ent_coef,
        value_weight=ppo.vf_coef,
        largest_gradient=ppo.max_grad_norm,
    )


def teacher_recipe(config: TrainConfig) -> Recipe:
    """The same with what differs for the teacher."""
    teacher = config.teacher
    return replace(
        recipe_of(config),
        layers=teacher.layers,
        log_std=teacher.log_std_init,
        learning_rate=teacher.learning_rate.start,
        log_std_end=teacher.log_std_end,
    )


class TensorEngine:
    """A learner in plain PyTorch, see :class:`robofish_agents.training.engines.Engine`.

    Args:
        config: of the training.
        stack: its fish.
    """

    def __init__(self, config: TrainConfig, stack: Stack) -> None:
        self.config, self.stack = config, stack
        self.recipe, self.lessons = recipe_of(config), teacher_recipe(config)
        self._sight: Sight | None = None
        if config.critic.privileged:
            self._sight = Sight([part.env.batch for part in stack.fish.parts])
        judged = self._sight.width if self._sight else None
        self._known = RunningMeanStd(shape=(judged or 0,))
        set_random_seed(config.seed)
        (seen,) = stack.outside.observation_space.shape or (0,)
        self.learner = ActorCritic(seen, ACTIONS, self.recipe, judged)
        self.optimiser = _adam(self.learner)
        self.teacher: ActorCritic | None = None
        if self._sight and config.teacher.steps:
            self.teacher = ActorCritic(self._sight.present, ACTIONS, self.lessons, judged)
            self.teacher_optimiser = _adam(self.teacher)
        if config.network.first_action:
            first = self.teacher or self.learner
            first.mean[-1].bias.data = torch.tensor(config.network.first_action)
        self._latest: np.ndarray | None = None
        self._log: logger.Logger | None = None
        self._succeeded: list[float] = []
        self._raw: list[np.ndarray] = []

    def imitate(self) -> None:
        """Refused by the configuration."""
        raise NotImplementedError("engine tensor does not imitate")

    def log_to(self, folder: Path) -> Callable[[str, float], object]:
        """Opens a TensorBoard log in a folder; returns a function that logs a name and a value."""
        self._log = logger.configure(str(folder), ["tensorboard"])
        return self._log.record

    def learn(self, books: Books) -> None:
        """Learns from the books' steps to those of the configuration."""
        config, steps = self.config, books.progress.steps
        lessons = config.teacher.steps
        fitted = lessons + config.teacher.distil_steps
        rollout = config.ppo.n_steps * config.num_envs
        if self._latest is None:
            self._latest = np.asarray(self.stack.outside.reset())
            self._stagger()
        while steps < config.total_steps:
            books.before_rollout(steps, ready=steps >= fitted)
            done = steps + rollout
            if steps < lessons:
                row = self._teach(books, steps, done / lessons)
            elif steps < fitted:
                row = self._distil(books, steps, (done - lessons) / (fitted - lessons))
                if done >= fitted:
                    self._graduate()
            else:
                row = self._practise(
                    books, steps, (done - fitted) / max(config.total_steps - fitted, 1)
                )
            steps = done
            self._report(steps, row)
        books.end(steps)

    def _teach(self, books: Books, steps: int, share: float) -> dict[str, float]:
        """Improves the teacher by a rollout of its own."""
        assert self.teacher
        taken, samples = self._collect(books, steps, self.teacher, privileged=True)
        rate = _set_rate(self.teacher_optimiser, self.config.teacher.learning_rate, share)
        kl = self.config.ppo.target_kl
        moved = improve(self.teacher, self.teacher_optimiser, samples, self.lessons, kl)
        self.teacher.limit_noise(self.lessons, share)
        return _row(self.teacher, taken, samples) | {"approx_kl": moved, "learning_rate": rate}

    def _graduate(self) -> None:
        """Ends the lessons: the policy gets the values of the teacher, and an optimiser of its own.

        The moments of Adam are those of small squared distances. With them the first steps of PPO
        would be far too long.
        """
        assert self.teacher
        self.learner.value.load_state_dict(self.teacher.value.state_dict())
        self.optimiser = _adam(self.learner)

    def _distil(self, books: Books, steps: int, share: float) -> dict[str, float]:
        """Lets the policy swim, and fits it to what the teacher would have done."""
        assert self.teacher
        assert self._sight
        taken, samples = self._collect(books, steps, self.learner, privileged=False)
        with torch.no_grad():
            wanted = self.teacher.mean(samples.judged[..., : self._sight.present])
        rate = _set_rate(self.optimiser, self.config.teacher.distil_rate, share)
        epochs = self.config.teacher.distil_epochs
        error = follow(self.learner, self.optimiser, samples.observed, wanted, self.recipe, epochs)
        return _row(self.learner, taken, samples) | {"distance": error, "learning_rate": rate}

    def _practise(self, books: Books, steps: int, share: float) -> dict[str, float]:
        """Improves the policy by a rollout of its own."""
        taken, samples = self._collect(books, steps, self.learner, privileged=False)
        rate = _set_rate(self.optimiser, self.config.ppo.learning_rate, share)
        kl = self.config.ppo.target_kl
        moved = improve(self.learner, self.optimiser, samples, self.recipe, kl)
        self.learner.limit_noise(self.recipe, share)
        return _row(self.learner, taken, samples) | {"approx_kl": moved, "learning_rate": rate}

    def _stagger(self) -> None:
        """Lets the fish begin their later episodes in turn."""
        for part in self.stack.fish.parts:
            part.env.set_elapsed(staggered(part.env.num_envs, part.env.max_episode_steps))

    def _collect(
        self, books: Books, steps: int, actor: ActorCritic, privileged: bool
    ) -> tuple[Taken, Samples]:
        """Takes the steps of a rollout.

        Args:
            books: told of every step.
            steps: control steps before.
            actor: what acts.
            privileged: whether it sees what the teacher sees; otherwise what the policy sees.

        Returns:
            Rewards and ends, and samples for an update.
        """
        count, outside = self.config.num_envs, self._outside
        rows: list[tuple[Tensor, ...]] = []
        ends: list[tuple[Tensor, ...]] = []
        with torch.no_grad():
            seen, judged = self._look()
            for step in range(self.recipe.steps):
                basis = judged[:, : self._present] if privileged else seen
                action, density = actor.act(basis)
                rows.append((basis, judged, action, density))
                self._latest, *rest = outside.step(action.clamp(-1.0, 1.0).numpy())
                ends.append(_ends(*rest))
                self._succeeded += [info["is_success"] for info in rest[2] if "episode" in info]
                books.stepped(steps + (step + 1) * count)
                seen, judged = self._look()
            books.after_rollout()
            basis, known, action, density = (
                torch.stack(column) for column in zip(*rows, strict=True)
            )
            value = actor.value(torch.cat([known, judged[None]])).squeeze(-1)
            taken = Taken(*(torch.stack(column) for column in zip(*ends, strict=True)))
            # The value before a truncation stands for that behind it, where an episode has begun.
            advantage, returns = generalised(taken, value, value[:-1], self.recipe)
        if self._sight:
            self._known.update(np.concatenate(self._raw))
            self._raw = []
        return taken, Samples(basis, known, action, density, advantage, returns)

    @property
    def _outside(self) -> Any:
        """The outermost wrapper of the fish."""
        return self.stack.outside

    @property
    def _present(self) -> int:
        return self._sight.present if self._sight else 0

    def _look(self) -> tuple[Tensor, Tensor]:
        """What the policy and what the critic see now, normalised."""
        assert self._latest is not None
        seen = torch.from_numpy(self._latest)
        if not self._sight:
            return seen, seen
        known = self._sight.see(self._outside.get_original_obs()[:, : len(OBSERVATION)])
        self._raw.append(known)
        normal = (known - self._known.mean) / np.sqrt(self._known.var + 1e-8)
        return seen, torch.from_numpy(np.clip(normal, -LIMIT, LIMIT).astype(np.float32))

    def _report(self, steps: int, row: Mapping[str, float]) -> None:
        succeeded, self._succeeded = self._succeeded, []
        if self._log is None:
            return
        for name, value in row.items():
            self._log.record(f"train/{name}", value)
        if succeeded:
            self._log.record("rollout/success_rate", float(np.mean(succeeded)))
        self._log.record("rollout/reward", float(np.mean(self._outside.get_original_reward())))
        self._log.dump(steps)

    def policy(self, about: Mapping[str, Any]) -> PolicyFile:
        """Returns the present deterministic policy, with a card."""
        outside = self._outside
        scale = (
            np.array(outside.obs_rms.mean, float),
            np.sqrt(outside.obs_rms.var + outside.epsilon),
        )
        network = network_of(self.learner, *scale, float(outside.clip_obs))
        spec = self.stack.past.history.spec
        return PolicyFile(network, spec, self.config.task, ENV_ID, about)

    def state(self) -> dict[str, Any]:
        """Returns plain values from which a later process continues with the same bits."""
        known = self._known
        return {
            "weights": [weights_state(learner.state_dict()) for learner, _ in self._pairs()],
            "optimisers": [optimiser_state(optimiser) for _, optimiser in self._pairs()],
            "latest": self._latest,
            "known": [known.mean, known.var, float(known.count)],
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restores a state; the state of the fish is restored before."""
        saved = zip(state["weights"], state["optimisers"], strict=True)
        for (learner, optimiser), (weights, moments) in zip(self._pairs(), saved, strict=True):
            learner.load_state_dict(weights_tensors(weights))
            restore_optimiser(optimiser, moments)
        if state["latest"] is not None:
            outside = self.stack.outside
            seen = observations_of(outside.observation_space, outside.num_envs)
            check_form(state["latest"], seen, "latest")
        known = self._known
        check_form(state["known"], [known.mean, known.var, float(known.count)], "known")
        self._latest = state["latest"]
        known.mean, known.var, known.count = state["known"]
        restore_random(state["random"])

    def _pairs(self) -> list[tuple[ActorCritic, torch.optim.Adam]]:
        pairs = [(self.learner, self.optimiser)]
        return [*pairs, (self.teacher, self.teacher_optimiser)] if self.teacher else pairs

    def close(self) -> None:
        """Closes the log, which has a thread."""
        if self._log is not None:
            self._log.close()


def _adam(learner: ActorCritic) -> torch.optim.Adam:
    return torch.optim.Adam(learner.parameters(), eps=1e-5)


def _set_rate(optimiser: torch.optim.Optimizer, rate: LearningRate, share: float) -> float:
    """Sets the step size after a share of a phase, and returns it."""
    end = rate.start if rate.end is None else rate.end
    now = rate.start + (end - rate.start) * min(share, 1.0)
    for group in optimiser.param_groups:
        group["lr"] = now
    return now


def _row(learner: ActorCritic, taken: Taken, samples: Samples) -> dict[str, float]:
    """What is logged of a rollout."""
    unexplained = samples.advantage.var() / (samples.returns.var() + 1e-8)
    return {
        "normalised_reward": float(taken.reward.mean()),
        "explained_variance": 1.0 - float(unexplained),
        "std": float(learner.log_std.detach().exp().mean()),
    }


def _ends(
    reward: np.ndarray, done: np.ndarray, infos: Sequence[Mapping[str, Any]]
) -> tuple[Tensor, ...]:
    """Rewards (N,) of a step, and whether episodes were terminated or truncated (1.0)."""
    truncated = np.zeros(len(done), np.float32)
    for lane in np.flatnonzero(done).tolist():
        truncated[lane] = infos[lane]["TimeLimit.truncated"]
    terminated = done.astype(np.float32) - truncated
    values = (np.asarray(reward, np.float32), terminated, truncated)
    return tuple(torch.from_numpy(value) for value in values)
