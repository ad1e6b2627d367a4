"""Past and low-pass filtered observations as inputs of a policy.

One observation of noisy, delayed sensors has little information on the water, and on how the fish
differs from the nominal one. Some frames and slow means of all sensors have more, without a
recurrent network.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.arrays import BoolArray
from fish_env.errors import ConfigError

Float32Array = npt.NDArray[np.float32]
MOST_FRAMES = 50


@dataclass(frozen=True)
class HistorySpec:
    """Past observations that a policy sees.

    Attributes:
        frames: observations side by side, the newest first; 1 is the present alone.
        low_pass_s: time constants of first-order filters of the whole observation (s).
        period_s: control period (s).
    """

    frames: int = 1
    low_pass_s: tuple[float, ...] = ()
    period_s: float = 0.1

    def __post_init__(self) -> None:
        """Refuses values that are not valid.

        Raises:
            ConfigError: says which.
        """
        if not 1 <= self.frames <= MOST_FRAMES:
            raise ConfigError(f"history.frames = {self.frames}: choose 1 to {MOST_FRAMES}")
        if not 0.0 < self.period_s < math.inf:
            raise ConfigError(f"history.period_s = {self.period_s}: more than 0 s")
        if not all(self.period_s <= constant < math.inf for constant in self.low_pass_s):
            raise ConfigError(
                f"history.low_pass_s = {list(self.low_pass_s)}: each at least the control period, "
                f"{self.period_s:g} s"
            )

    def width(self, observation: int) -> int:
        """Returns the number of inputs of the policy, for the size of an observation."""
        return observation * (self.frames + len(self.low_pass_s))


class History:
    """Past observations of N parallel, independent episodes.

    Args:
        spec: past observations that the policy sees.
        count: episodes.
        observation: numbers in one observation.
    """

    def __init__(self, spec: HistorySpec, count: int, observation: int) -> None:
        self.spec = spec
        self._share = [
            np.float32(-np.expm1(-spec.period_s / constant)) for constant in spec.low_pass_s
        ]
        self._frames = np.zeros((spec.frames, count, observation), np.float32)
        self._filters = np.zeros((len(spec.low_pass_s), count, observation), np.float32)
        self._fresh = np.ones(count, bool)

    def restart(self, ended: BoolArray) -> None:
        """The next observation of these episodes (N,) is their first."""
        self._fresh |= ended

    def push(self, observations: Float32Array) -> Float32Array:
        """Takes the next observations (N, n) and returns what the policy sees, (N, width).

        Before the first observation, all past observations equal it.
        """
        self._frames[1:] = self._frames[:-1].copy()
        self._frames[0] = observations
        if self._fresh.any():
            self._frames[:, self._fresh] = observations[self._fresh]
            self._filters[:, self._fresh] = observations[self._fresh]
            self._fresh[:] = False
        for filtered, share in zip(self._filters, self._share, strict=True):
            filtered += share * (observations - filtered)
        return self._beside(self._frames, self._filters)

    def last(self, lane: int, observation: Float32Array) -> Float32Array:
        """What the policy would see of an episode's last observation (n,); changes nothing."""
        frames = np.concatenate([observation[None], self._frames[:-1, lane]])
        filters = self._filters[:, lane].copy()
        for filtered, share in zip(filters, self._share, strict=True):
            filtered += share * (observation - filtered)
        return self._beside(frames, filters)

    def save_state(self) -> dict[str, npt.NDArray[Any]]:
        """What was seen, as arrays."""
        return {"frames": self._frames, "filters": self._filters, "fresh": self._fresh}

    def load_state(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Restores the result of :meth:`save_state`.

        Raises:
            KeyError, ValueError: arrays are missing or have other shapes.
        """
        self._frames[:] = state["frames"]
        self._filters[:] = state["filters"]
        self._fresh[:] = state["fresh"]

    @staticmethod
    def _beside(frames: Float32Array, filters: Float32Array) -> Float32Array:
        return np.concatenate([*frames, *filters], axis=-1)
