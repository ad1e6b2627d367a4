"""How a vehicle declares its effects; light to import, as the physics does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes:
        name: public name, as in files, reports and on the command line.
        unit: SI unit, ``-`` when it has none.
        neutral: value at which the effect is off (may be infinite).
        lower: smallest physically meaningful value.
        upper: largest physically meaningful value.
        plausible: range (low, high) that a real vehicle of this size may show.
        description: what it is.
        shapes: it only says where, when or how the effect acts; other parameters switch it on.
        probed: whether a search starts from several values of one that shapes; else from neutral.
    """

    name: str
    unit: str
    neutral: float
    lower: float = -inf
    upper: float = inf
    plausible: tuple[float, float] = (-1.0, 1.0)
    description: str = ""
    shapes: bool = False
    probed: bool = True

    def far_end(self, value: float) -> float:
        """The end of the plausible range that is farther from a value, the upper of two alike."""
        low, high = self.plausible
        return high if abs(high - value) >= abs(low - value) else low


Parts = Mapping[str, Mapping[str, float]]
"""Names of effects -> their parameters."""


class Switched:
    """Something with parameters that switch it on.

    Attributes:
        parameters: its parameters.
        parts: parameters -> other effects, with their parameters, that together do nearly the
            same; empty where none do.
    """

    parameters: tuple[EffectParameter, ...]
    parts: Callable[[Mapping[str, float]], Parts] | None

    @property
    def neutral(self) -> dict[str, float]:
        """Parameter values that switch the effect off."""
        return {p.name: p.neutral for p in self.parameters}

    @property
    def switching(self) -> tuple[EffectParameter, ...]:
        """The parameters that switch it on; the others only shape it."""
        return tuple(p for p in self.parameters if not p.shapes)

    def in_parts(self, values: Mapping[str, float]) -> Parts:
        """Other effects, with their parameters, that together do nearly the same; or none."""
        return self.parts(values) if self.parts is not None else {}


@dataclass(frozen=True, eq=False)
class DeclaredEffect(Switched):
    """An effect of a vehicle, for the inference; what it does is the problem's business.

    Attributes:
        name: public name.
        parameters: its parameters.
        confusable_with: names of effects with a similar signature.
        equals: baseline coefficients (paths) other values of which do exactly the same.
        nonsmooth: whether it makes the motion's rate jump, so that slopes tell little of large
            sizes.
        drifts_in_phase: whether a periodic drive gets ever further out of phase.
        diagnosed: whether a diagnosis looks for it; else it is only simulated, and fitted if asked.
        parts: parameters -> other effects, with their parameters, that together do nearly the
            same; default: none do.
    """

    name: str
    parameters: tuple[EffectParameter, ...]
    confusable_with: tuple[str, ...] = ()
    equals: tuple[str, ...] = ()
    nonsmooth: bool = False
    drifts_in_phase: bool = False
    diagnosed: bool = True
    parts: Callable[[Mapping[str, float]], Parts] | None = None

    def is_followed(self, values: Mapping[str, float], step: float) -> bool:
        """Whether simulation steps (s) follow it at these values: they do, at any."""
        return True
