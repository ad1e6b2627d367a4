"""What evaluating runs leaves, what noise models have, and what tests of adequacy ask for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from fish_env.arrays import FloatArray, IntArray


class Noise(Protocol):
    """A noise model: the problem's own, with spreads (K,) over runs as ``spread`` if it has any."""

    def is_close(self, other: Any, share: float) -> bool:
        """Whether another noise model differs by less than a share of this one."""
        ...


class Evaluation(Protocol):
    """What evaluating one run at a point has left: its likelihood, and the weighting to hold."""

    @property
    def log_likelihood(self) -> float:
        """Without its constant."""
        ...

    @property
    def residuals(self) -> FloatArray:
        """(D_r,) whitened residuals of the run."""
        ...


@dataclass(frozen=True)
class LackOfFit:
    """What the model misses against what repeats of a run differ by.

    Attributes:
        ratio: mean square of the first over that of the second.
        p_value: of so large a ratio by chance.
    """

    ratio: float
    p_value: float


class GenericTerms(Protocol):
    """Forces of no particular origin that the adequacy test adds one at a time."""

    @property
    def columns(self) -> IntArray:
        """(N,) numbers of the terms."""
        ...

    def words(self, column: int) -> tuple[str, str]:
        """What a term depends on, and its direction."""
        ...

    def swings(self, column: int) -> bool:
        """Whether a term swings with what drives the vehicle: its size then follows the drive."""
        ...

    def unit(self, column: int) -> float:
        """Root mean square of a term (SI) for each unit of its change."""
        ...

    def changes(self, columns: IntArray) -> FloatArray:
        """What small amounts of some terms change in the residuals, (D, N)."""
        ...
