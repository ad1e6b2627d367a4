"""PPO over tensors: rollouts and updates stay on the device of the environment.

For :class:`fish_env.gpu.vector.RoboticFish3DDeviceEnv`, whose tensors are the memory of the GPU, so
that nothing goes through the host. On the CPU :class:`robofish_agents.training.host_env.HostEnv`
gives the same interface, with which recipes can be tried without a GPU.

Schulman et al., "Proximal Policy Optimization Algorithms", arXiv:1707.06347; advantages by
"High-Dimensional Continuous Control Using Generalized Advantage Estimation", arXiv:1506.02438.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from fish_env.arrays import IntArray
from robofish_agents.training.actor_critic import ActorCritic, Recipe
from robofish_agents.training.replayed import Replayed, differentiable

GROUPS = 16
"""Fish of a batch begin their later episodes in so many groups, one after the other."""
LIMIT = 10.0
"""Normalised observations are clipped to this."""


class Rollout(NamedTuple):
    """A rollout, (steps, N, ...) each; ``observed`` and ``judged`` have those behind it too.

    ``judged`` and ``final`` are what the critic sees.
    """

    observed: Tensor
    judged: Tensor
    actions: Tensor
    log_probability: Tensor
    reward: Tensor
    terminated: Tensor
    truncated: Tensor
    final: Tensor


class Taken(NamedTuple):
    """Rewards of a rollout and where episodes ended (1.0), (steps, N) each."""

    reward: Tensor
    terminated: Tensor
    truncated: Tensor


class Samples(NamedTuple):
    """What an update learns from, (steps, N, ...) or (samples, ...) each.

    ``judged`` is what the critic sees; ``log_probability`` that of the actions when taken.
    """

    observed: Tensor
    judged: Tensor
    actions: Tensor
    log_probability: Tensor
    advantage: Tensor
    returns: Tensor


LossFunction = Callable[..., tuple[Tensor, ...]]
"""Loss and distance moved, of the tensors of a minibatch in the order of :class:`Samples`."""


class Trained(NamedTuple):
    """A policy, and how it came about.

    Attributes:
        policy: the policy.
        seconds: time of training (s).
        steps: control steps of all fish together.
        updates: gradient steps.
    """

    policy: ActorCritic
    seconds: float
    steps: int
    updates: int


def staggered(count: int, longest: int) -> IntArray:
    """Control steps (count,) that fish count as taken, so that they begin their episodes in turn.

    Args:
        count: number of fish.
        longest: control steps of an episode.
    """
    group = np.arange(count) * GROUPS // count
    return group * (longest // GROUPS)


def collect(
    env: Any, policy: ActorCritic, observed: Tensor, recipe: Recipe, judged: Tensor | None = None
) -> Rollout:
    """Take the steps of one rollout.

    Args:
        env: an environment of tensors.
        policy: acts.
        observed: the environment's own tensor of observations.
        recipe: says how many steps.
        judged: its own tensor of what the critic sees; None: the observations.
    """
    steps, device = recipe.steps, observed.device
    known = observed if judged is None else judged
    count, actions = observed.shape[0], env.single_action_space.shape[0]

    def rows(*shape: int) -> Tensor:
        return torch.empty(shape, device=device)

    seen = rows(steps + 1, *observed.shape)
    taken = Rollout(
        seen,
        seen if judged is None else rows(steps + 1, *known.shape),
        rows(steps, count, actions),
        rows(steps, count),
        rows(steps, count),
        rows(steps, count),
        rows(steps, count),
        rows(steps, *known.shape),
    )
    final = "final_obs" if judged is None else "final_judged"
    with torch.no_grad():
        for step in range(steps):
            taken.observed[step], taken.judged[step] = observed, known
            taken.actions[step], taken.log_probability[step] = policy.act(observed)
            _, reward, terminated, truncated, infos = env.step(taken.actions[step])
            taken.reward[step] = recipe.reward_scale * reward
            taken.terminated[step], taken.truncated[step] = terminated, truncated
            taken.final[step] = infos[final]
        taken.observed[steps], taken.judged[steps] = observed, known
    return taken


def advantages(policy: ActorCritic, taken: Rollout, recipe: Recipe) -> tuple[Tensor, Tensor]:
    """Generalised advantages and returns, (steps, N) each.

    A truncated episode would have gone on: the value of where it was cut off counts.

    Args:
        policy: gives the values.
        taken: the rollout.
        recipe: discount and decay.
    """
    with torch.no_grad():
        value = policy.value(taken.judged).squeeze(-1)
        cut_off = policy.value(taken.final).squeeze(-1)
    return generalised(taken, value, cut_off, recipe)


def generalised(
    taken: Rollout | Taken, value: Tensor, cut_off: Tensor, recipe: Recipe
) -> tuple[Tensor, Tensor]:
    """Generalised advantages and returns, (steps, N) each, from values.

    Args:
        taken: rewards and ends of episodes, (steps, N) each.
        value: (steps + 1, N) values before each step and behind the last.
        cut_off: (steps, N) value of the state where a truncated episode ended.
        recipe: discount and decay.
    """
    goes_on = 1.0 - torch.maximum(taken.terminated, taken.truncated)
    following = torch.where(taken.truncated > 0.0, cut_off, goes_on * value[1:])
    surprise = taken.reward + recipe.gamma * following - value[:-1]
    found, ahead = torch.empty_like(surprise), torch.zeros_like(surprise[0])
    decay = recipe.gamma * recipe.trace * goes_on
    for step in reversed(range(len(found))):
        ahead = surprise[step] + decay[step] * ahead
        found[step] = ahead
    return found, found + value[:-1]


def loss_of(policy: ActorCritic, batch: Samples, recipe: Recipe) -> tuple[Tensor, Tensor]:
    """Loss of a minibatch, and an estimate of how far the policy has moved (its KL divergence)."""
    advantage = (batch.advantage - batch.advantage.mean()) / (batch.advantage.std() + 1e-8)
    change = policy.log_probability(batch.observed, batch.actions) - batch.log_probability
    ratio = torch.exp(change)
    clipped = torch.clamp(ratio, 1.0 - recipe.clip, 1.0 + recipe.clip)
    gain = torch.minimum(ratio * advantage, clipped * advantage).mean()
    error = policy.value(batch.judged).squeeze(-1) - batch.returns
    loss: Tensor = recipe.value_weight * (error * error).mean() - gain
    if recipe.entropy:
        loss = loss - recipe.entropy * policy.log_std.sum()  # that of a normal but for a constant
    return loss, (ratio.detach() - 1.0 - change.detach()).mean()


def loss_function(policy: ActorCritic, recipe: Recipe) -> LossFunction:
    """:func:`loss_of` as a function of the tensors of a minibatch."""
    return lambda *batch: loss_of(policy, Samples(*batch), recipe)


def samples_of(policy: ActorCritic, taken: Rollout, recipe: Recipe) -> Samples:
    """What there is to learn from a rollout."""
    advantage, returns = advantages(policy, taken, recipe)
    seen, judged = taken.observed[:-1], taken.judged[:-1]
    return Samples(seen, judged, taken.actions, taken.log_probability, advantage, returns)


def _in_a_row(whole: Samples, recipe: Recipe) -> tuple[list[Tensor], int]:
    """The samples (steps * N, ...) one after another, and how many a minibatch has."""
    flat = [rows.flatten(0, 1) for rows in whole]
    return flat, len(flat[0]) // recipe.minibatches


def improve(
    policy: ActorCritic,
    optimiser: torch.optim.Optimizer,
    whole: Samples,
    recipe: Recipe,
    target_kl: float | None = None,
    loss_fn: LossFunction | None = None,
) -> float:
    """Take the gradient steps of an update.

    Args:
        policy: changed.
        optimiser: of its parameters.
        whole: a rollout, (steps, N, ...) each.
        recipe: epochs, minibatches and weights of the loss.
        target_kl: the update ends where the policy has moved by 1.5 times this; None: never.
        loss_fn: gives what :func:`loss_of` gives of the tensors of a minibatch; default: that.

    Returns:
        How far the policy had moved in the last minibatch.
    """
    flat, size = _in_a_row(whole, recipe)
    count, moved = len(flat[0]), 0.0
    loss_fn = loss_fn or loss_function(policy, recipe)
    for _ in range(recipe.epochs):
        order = torch.randperm(count, device=flat[0].device)
        for first in range(0, size * recipe.minibatches, size):
            chosen = order[first : first + size]
            loss, distance = loss_fn(*(rows[chosen] for rows in flat))
            if target_kl is not None:
                moved = float(distance)
                if moved > 1.5 * target_kl:
                    return moved
            optimiser.zero_grad(set_to_none=True)
            torch.autograd.backward(loss)
            nn.utils.clip_grad_norm_(policy.parameters(), recipe.largest_gradient)
            optimiser.step()
    return moved


def follow(
    policy: ActorCritic,
    optimiser: torch.optim.Optimizer,
    observed: Tensor,
    wanted: Tensor,
    recipe: Recipe,
    epochs: int,
) -> float:
    """Fit the mean actions of a policy to those of a teacher by least squares.

    Args:
        policy: changed.
        optimiser: of its parameters.
        observed: (steps, N, ...) what it saw.
        wanted: (steps, N, actions) what the teacher would have done; clipped to [-1, 1].
        recipe: minibatches and longest gradient.
        epochs: passes.

    Returns:
        Mean squared distance of the last minibatch.
    """
    seen, targets = observed.flatten(0, 1), wanted.clamp(-1.0, 1.0).flatten(0, 1)
    size, distance = len(seen) // recipe.minibatches, torch.zeros(())
    for _ in range(epochs):
        order = torch.randperm(len(seen), device=seen.device)
        for first in range(0, size * recipe.minibatches, size):
            chosen = order[first : first + size]
            distance = nn.functional.mse_loss(policy.mean(seen[chosen]), targets[chosen])
            optimiser.zero_grad(set_to_none=True)
            torch.autograd.backward(distance)
            nn.utils.clip_grad_norm_(policy.parameters(), recipe.largest_gradient)
            optimiser.step()
    return float(distance.detach())


def train(
    env: Any, recipe: Recipe, seed: int, watch: Callable[[int, ActorCritic], None] | None = None
) -> Trained:
    """Train a policy.

    Args:
        env: an environment of tensors that restarts episodes within a step. If ``infos`` of its
            ``reset`` have ``judged``, the critic sees that.
        recipe: what to do.
        seed: of weights, actions and fish.
        watch: called with the number of rollouts so far and the policy, before each of them and
            at the end; its time does not count.
    """
    torch.manual_seed(seed)
    observed, infos = env.reset(seed=seed)
    judged = infos.get("judged")
    _wait(observed)
    started, watched = time.perf_counter(), 0.0
    sizes = observed.shape[1], env.single_action_space.shape[0]
    wide = None if judged is None else judged.shape[1]
    policy = ActorCritic(*sizes, recipe, wide).to(observed.device)
    optimiser = torch.optim.Adam(
        policy.parameters(), recipe.learning_rate, eps=1e-5, fused=observed.is_cuda
    )
    swim = Replayed(partial(collect, env, policy, observed, recipe, judged), observed.is_cuda)
    loss_fn = None
    for iteration in range(recipe.iterations):
        if watch:
            watched += _timed(observed, partial(watch, iteration, policy))
        done = iteration / recipe.iterations
        for group in optimiser.param_groups:
            group["lr"] = recipe.learning_rate * (1.0 - done)
        whole = samples_of(policy, swim(), recipe)
        loss_fn = loss_fn or _loss_on_device(policy, whole, recipe)
        improve(policy, optimiser, whole, recipe, loss_fn=loss_fn)
        policy.limit_noise(recipe, done)
    _wait(observed)
    seconds = time.perf_counter() - started - watched
    if watch:
        watch(recipe.iterations, policy)
    return Trained(
        policy,
        seconds,
        recipe.iterations * recipe.steps * len(observed),
        recipe.iterations * recipe.epochs * recipe.minibatches,
    )


def _timed(tensor: Tensor, function: Callable[[], None]) -> float:
    """Time (s) that a function takes, once the device of a tensor has done all before."""
    _wait(tensor)
    started = time.perf_counter()
    function()
    _wait(tensor)
    return time.perf_counter() - started


def _loss_on_device(policy: ActorCritic, whole: Samples, recipe: Recipe) -> LossFunction:
    """The loss of minibatches of such samples, replayed where they are on a GPU."""
    flat, size = _in_a_row(whole, recipe)
    like = tuple(rows[:size] for rows in flat)
    return differentiable(policy, loss_function(policy, recipe), like)


def success_rate(env: Any, policy: ActorCritic, seed: int) -> float:
    """Share of fish that succeed in their first episode with the policy's mean actions.

    Args:
        env: an environment of tensors that restarts episodes within a step.
        policy: what acts.
        seed: of the fish.
    """
    observed, _ = env.reset(seed=seed)
    waiting = torch.ones(len(observed), dtype=torch.bool, device=observed.device)
    succeeded = torch.zeros_like(waiting)
    with torch.no_grad():
        while bool(waiting.any()):
            observed, _, terminated, truncated, infos = env.step(policy.mean(observed))
            ended = (terminated | truncated) & waiting
            held = infos["final_info"]["is_success"] > 0.0
            succeeded |= ended & held & ~terminated
            waiting &= ~ended
    return float(succeeded.float().mean())


def _wait(tensor: Tensor) -> None:
    """Wait for the device of a tensor."""
    if tensor.is_cuda:
        torch.cuda.synchronize()
