"""Fish under several conditions as one environment of tensors, as a policy and a critic see them.

The policy sees present and filtered observations. The critic sees what no sensor measures
(:mod:`robofish_agents.training.privileged`). Both are normalised by their running mean and
deviation. All of it happens on the device of the fish, without a copy to the host.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from fish_env.envs.layout import OBSERVATION
from fish_env.gpu.arrays import tensor
from robofish_agents.policies.history import HistorySpec
from robofish_agents.training.privileged import Sight
from robofish_agents.training.tensor_ppo import LIMIT, staggered

FLOOR = 1e-8
"""Added to variances, so that what never changes can be divided by its deviation."""


class TensorTruth:
    """What is true of the fish of a batch, as tensors of its own memory.

    Args:
        batch: on the CPU or on a device.
    """

    def __init__(self, batch: Any) -> None:
        self.options, self.count = batch.options, batch.count
        self.state, self.goal = _shared(batch.state), _shared(batch.goal)
        self.time, self.outputs = _shared(batch.time), _shared(batch.outputs)
        self.drawn = {path: _shared(values) for path, values in batch.drawn.items()}


def _shared(array: Any) -> Tensor:
    if isinstance(array, np.ndarray):
        return torch.from_numpy(array)
    found: Tensor = tensor(array)
    return found


class Scale:
    """Running mean and deviation of each number of an observation.

    Args:
        like: (N, n) such observations.
    """

    def __init__(self, like: Tensor) -> None:
        self.mean = torch.zeros(like.shape[1], dtype=torch.float64, device=like.device)
        self.variance = torch.ones_like(self.mean)
        self.count = torch.full((), 1e-4, dtype=torch.float64, device=like.device)

    def learn(self, rows: Tensor) -> None:
        """Counts further observations (N, n).

        Chan, Golub and LeVeque, "Algorithms for computing the sample variance", The American
        Statistician 37, 1983.
        """
        count = len(rows)
        total = self.count + count
        mean = rows.mean(0).double()
        apart = mean - self.mean
        inside = ((rows - mean.float()) ** 2).mean(0).double() * count
        inside += self.variance * self.count + apart * apart * (self.count * count / total)
        self.mean += apart * (count / total)
        self.variance.copy_(inside / total)
        self.count.copy_(total)

    def deviation(self) -> Tensor:
        """(n,) what normalised numbers were divided by."""
        return torch.sqrt(self.variance + FLOOR)

    def __call__(self, rows: Tensor) -> Tensor:
        """Normalised observations."""
        return ((rows - self.mean.float()) / self.deviation().float()).clamp(-LIMIT, LIMIT)


class TensorHistory:
    """As :class:`robofish_agents.policies.history.History`, of tensors.

    Args:
        spec: past observations that the policy sees.
        like: (N, n) observations.
    """

    def __init__(self, spec: HistorySpec, like: Tensor) -> None:
        self._share = [-float(np.expm1(-spec.period_s / constant)) for constant in spec.low_pass_s]
        self._frames = [torch.zeros_like(like) for _ in range(spec.frames)]
        self._filters = [torch.zeros_like(like) for _ in spec.low_pass_s]

    def push(self, observed: Tensor, fresh: Tensor) -> Tensor:
        """Takes the next observations (N, n) and returns what the policy sees, (N, width).

        Args:
            observed: (N, n).
            fresh: (N,) which of them are the first of their episodes.
        """
        first, frames = fresh[:, None], self._frames
        for newer, older in zip(frames[-2::-1], frames[:0:-1], strict=True):
            older.copy_(torch.where(first, observed, newer))
        frames[0].copy_(observed)
        for filtered, share in zip(self._filters, self._share, strict=True):
            before = torch.where(first, observed, filtered)
            filtered.copy_(before + share * (observed - before))
        return torch.cat([*frames, *self._filters], 1)


class CriticView:
    """What a critic sees of fish.

    Attributes:
        judged: (N, m) of the present state, normalised.
        before: (N, m) of the state before.

    Args:
        parts: the fish.
    """

    def __init__(self, parts: Sequence[Any]) -> None:
        self._sight = Sight([TensorTruth(part.batch) for part in parts], torch)
        count = sum(part.num_envs for part in parts)
        self.judged = _shared(parts[0].batch.obs).new_zeros(count, self._sight.width)
        self.before = torch.zeros_like(self.judged)
        self._scale = Scale(self.judged)

    def look(self, observed: Tensor) -> None:
        """Goes on to the present state; ``observed`` are the observations (N, 33) of the fish."""
        known = self._sight.see(observed)
        self._scale.learn(known)
        self.before.copy_(self.judged)
        self.judged.copy_(self._scale(known))


class TensorShoal:
    """Fish under several conditions as one environment of tensors.

    Attributes:
        spec: past observations that the policy sees.
        seen: scale of what the policy sees.
    """

    def __init__(self, parts: Sequence[Any], spec: HistorySpec, like: TensorShoal | None = None):
        """Put the fish side by side.

        Args:
            parts: environments of tensors with the same spaces, which restart episodes within a
                step and have a ``batch``.
            spec: past observations that the policy sees.
            like: its scale is used and does not change any more, and there is nothing for a
                critic; default: own scales.
        """
        self.parts, self.spec = tuple(parts), spec
        self.single_action_space = self.parts[0].single_action_space
        self.num_envs = sum(part.num_envs for part in self.parts)
        self._sizes = [part.num_envs for part in self.parts]
        self._raw = torch.cat([_shared(part.batch.obs) for part in self.parts])
        self._past = TensorHistory(spec, self._raw)
        self.observed = self._raw.new_zeros(self.num_envs, spec.width(len(OBSERVATION)))
        self.seen: Scale = like.seen if like else Scale(self.observed)
        self._critic = None if like else CriticView(self.parts)

    def reset(self, *, seed: int) -> tuple[Tensor, dict[str, Tensor]]:
        """Begin all episodes; ``infos["judged"]`` is what the critic sees.

        Where there is a critic, fish begin their later episodes in turn, so that every
        rollout has all parts of an episode.

        Args:
            seed: part i gets the seed ``seed * parts + i``.
        """
        parts = len(self.parts)
        first = [part.reset(seed=seed * parts + i)[0] for i, part in enumerate(self.parts)]
        self._look(first, torch.ones_like(self._raw[:, 0], dtype=torch.bool))
        if self._critic is None:
            return self.observed, {}
        for part in self.parts:
            part.set_elapsed(staggered(part.num_envs, part.max_episode_steps))
        return self.observed, {"judged": self._critic.judged}

    def step(self, actions: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, dict[str, Any]]:
        """One control step of every fish.

        ``infos["final_judged"]`` is what the critic saw before the step: the value of a state at
        which an episode is cut off is taken from there, a control step earlier.
        """
        steps = zip(self.parts, torch.split(actions, self._sizes), strict=True)
        raw, reward, terminated, truncated, infos = zip(
            *(part.step(rows) for part, rows in steps), strict=True
        )
        failed, over = torch.cat(terminated), torch.cat(truncated)
        self._look(raw, failed | over)
        held = torch.cat([info["final_info"]["is_success"] for info in infos])
        left: dict[str, Any] = {"final_info": {"is_success": held}}
        if self._critic is not None:
            left["final_judged"] = self._critic.before
        return self.observed, torch.cat(reward), failed, over, left

    def _look(self, observed: Sequence[Tensor], fresh: Tensor) -> None:
        raw = torch.cat(tuple(observed), out=self._raw)
        wide = self._past.push(raw, fresh)
        if self._critic is not None:
            self.seen.learn(wide)
            self._critic.look(raw)
        self.observed.copy_(self.seen(wide))
