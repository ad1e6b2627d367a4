"""Values that an exported policy keeps between two steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.envs.layout import OBSERVATION
from robofish_agents.policies.files import PolicyFile


@dataclass(frozen=True, eq=False)
class Memory:
    """The past as :class:`robofish_agents.policies.history.History` keeps it, for one fish.

    Attributes:
        frames: past observations, the newest first.
        shares: of each low-pass filter, the share of the way to the observation in a step.
    """

    frames: int
    shares: npt.NDArray[np.float32]

    @classmethod
    def of(cls, policy: PolicyFile) -> Memory:
        """Returns the memory that a policy needs."""
        history = policy.history
        constants = np.array(history.low_pass_s, float)
        shares = -np.expm1(-history.period_s / constants)
        return cls(history.frames - 1, shares.astype(np.float32))

    @property
    def rows(self) -> int:
        """Past frames and filters, each as long as an observation."""
        return self.frames + len(self.shares)

    @property
    def size(self) -> int:
        """Total number of values."""
        return self.rows * len(OBSERVATION)
