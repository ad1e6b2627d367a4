"""Imitation of a teacher before reinforcement learning.

Rounds as in DAgger (Ross, Gordon and Bagnell 2011): the learner swims, the teacher, which knows the
true state, says what it would have done, and the network is fitted to all that was said so far. The
first round is swum by the teacher. In the end the value network is fitted to the
returns of the last round, so that the first updates do not spoil what was learnt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3 import PPO
from torch import nn

from fish_env.arrays import BoolArray, FloatArray
from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import MAX_EPISODE_STEPS
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.settings import Imitation
from robofish_agents.training.stack import Stack
from robofish_agents.training.teacher import Teacher

Float32Array = npt.NDArray[np.float32]
BATCH = 1024
STEP_SIZE = 1e-3
NOISE = 0.1
"""Standard deviation of what is added to actions, so that the fish sees more than one path."""
BLOCK = 3
"""Which action is the block's displacement."""


@dataclass(frozen=True)
class Swim:
    """One episode of all fish.

    Attributes:
        seen: (T, N, n) inputs of the policy, not normalised.
        wanted: (T, N, 5) actions of the teacher.
        reward: (T, N) normalised as for the learner.
        ended: (T, N).
    """

    seen: Float32Array
    wanted: Float32Array
    reward: Float32Array
    ended: BoolArray


def imitate(model: PPO, stack: Stack, config: TrainConfig, settings: Imitation) -> None:
    """Fits policy and values of an untrained learner to a teacher."""
    rng = np.random.default_rng(config.seed)
    outside: Any = stack.outside
    teacher = Teacher(stack.fish.parts, settings)
    swims: list[Swim] = []
    for round_ in range(settings.rounds):
        swims.append(_swim(model, stack, teacher, rng, by_teacher=round_ == 0))
        wanted = np.concatenate([_rows(swim.wanted) for swim in swims])
        _fit(model, _policy, _normalised(outside, swims), wanted, settings.epochs)
    _stretch(model, settings.stretch)
    last, discount = swims[-1], config.ppo.gamma
    # The return of a step near the end is cut off by the end of the swim.
    whole = len(last.reward) - round(2.0 / (1.0 - discount))
    returns = _returns(last, discount)[:whole].reshape(-1, 1)
    values = outside.normalize_obs(_rows(last.seen[:whole]))
    _fit(model, _values, values, returns.astype(np.float32), settings.epochs)


def _stretch(model: PPO, factor: float) -> None:
    # With noise in what it sees, a least-squares fit answers with less than the teacher would.
    with torch.no_grad():
        for values in model.policy.action_net.parameters():
            values[BLOCK] *= factor


def _swim(
    model: PPO, stack: Stack, teacher: Teacher, rng: np.random.Generator, by_teacher: bool
) -> Swim:
    outside: Any = stack.outside
    normal = outside.reset()
    teacher.reset(outside.num_envs)
    rows: list[tuple[Any, ...]] = []
    for _ in range(MAX_EPISODE_STEPS - 1):
        seen = outside.get_original_obs()
        wanted = teacher.act(seen[:, : len(OBSERVATION)])
        action = wanted if by_teacher else model.predict(normal, deterministic=True)[0]
        action = np.clip(action + NOISE * rng.standard_normal(action.shape), -1.0, 1.0)
        normal, reward, ended, _ = outside.step(action.astype(np.float32))
        rows.append((seen, wanted, reward, ended))
    return Swim(*(np.stack(column) for column in zip(*rows, strict=True)))


def _rows(values: Float32Array) -> Float32Array:
    return values.reshape(-1, values.shape[-1])


def _normalised(outside: Any, swims: list[Swim]) -> Float32Array:
    # A step at a time: of all at once there would be several copies of gigabytes.
    steps = [step for swim in swims for step in swim.seen]
    normal = np.empty((len(steps), *steps[0].shape), np.float32)
    for into, step in zip(normal, steps, strict=True):
        into[:] = outside.normalize_obs(step)
    return _rows(normal)


def _returns(swim: Swim, discount: float) -> FloatArray:
    returns = np.zeros(swim.reward.shape)
    following = np.zeros(swim.reward.shape[1])
    for step in range(len(returns) - 1, -1, -1):
        following = swim.reward[step] + discount * following * ~swim.ended[step]
        returns[step] = following
    return returns


def _policy(policy: Any, inputs: torch.Tensor) -> Any:
    return policy.action_net(policy.mlp_extractor.forward_actor(inputs))


def _values(policy: Any, inputs: torch.Tensor) -> Any:
    return policy.value_net(policy.mlp_extractor.forward_critic(inputs))


def _fit(model: PPO, output: Any, seen: np.ndarray, wanted: np.ndarray, epochs: int) -> None:
    inputs, targets = torch.as_tensor(seen), torch.as_tensor(wanted)
    optimiser = torch.optim.Adam(model.policy.parameters(), lr=STEP_SIZE)
    slower = torch.optim.lr_scheduler.LinearLR(optimiser, 1.0, 1.0 / epochs, epochs)
    for _ in range(epochs):
        for rows in torch.split(torch.randperm(len(inputs)), BATCH):
            loss = nn.functional.mse_loss(output(model.policy, inputs[rows]), targets[rows])
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
        slower.step()
