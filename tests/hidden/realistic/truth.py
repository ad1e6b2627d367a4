"""What is hidden in a realistic case: kept beside the dataset's folder, never in it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tests.hidden.realistic.catalogue import BENIGN, SAME

Values = dict[str, dict[str, float]]


@dataclass(frozen=True)
class RealTruth:
    """The answer to one case.

    Attributes:
        tier: which kind of case.
        seed: its number.
        fish: nominal fish that the dataset names.
        strength: size of the main effect, 1 is typical.
        main: the effect that acts most, with its parameters; empty where there is none.
        small: further effects of the catalogue, each a tenth to a fifth of a usual size.
        dirt: what is wrong with the sensors.
        variation: parameters by effect of each run that differ from run to run.
        suspect: the one thing that acts, of the tier of suspects; a fault of the inputs has no
            parameters.
        foreign: physics that no catalogue has.
        tells: words of which a message about a wrong input has at least one.
        coefficients: every number of the true fish, by path.
        disturbance: colour, force, time constant and frame of the random push.
        noise: one-sigma sensor noise by channel.
        budget: share of the misfit of the nominal simulation by hidden thing; each by channel and
            as "all".
        about: anything else worth knowing of the case.
    """

    tier: str
    seed: int
    fish: str
    strength: float = 1.0
    main: Values = field(default_factory=dict)
    small: Values = field(default_factory=dict)
    dirt: Values = field(default_factory=dict)
    variation: list[Values] = field(default_factory=list)
    suspect: Values = field(default_factory=dict)
    foreign: Values = field(default_factory=dict)
    tells: tuple[str, ...] = ()
    coefficients: dict[str, float] = field(default_factory=dict)
    disturbance: dict[str, Any] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    budget: Values = field(default_factory=dict)
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def acting(self) -> tuple[str, ...]:
        """Names of everything that acts, sorted; faults by their own names."""
        varied = {name for values in self.variation for name in values}
        parts = (self.main, self.small, self.dirt, self.suspect, self.foreign, varied)
        return tuple(sorted({name for part in parts for name in part}))

    @property
    def benign(self) -> bool:
        """Whether what acts alone is nothing but noise of another kind."""
        return bool(self.suspect) and set(self.suspect) <= set(BENIGN)

    def is_true(self, name: str) -> bool:
        """Whether a published name is one of the hidden things, or says the same."""
        return any(name in names_of(hidden) for hidden in self.acting)

    @property
    def label(self) -> str:
        """Row of the table of answers."""
        if self.main:
            return f"{' + '.join(self.main)} among {len(self.small)} small"
        if self.small:
            return f"{len(self.small)} small"
        return " + ".join((*self.suspect, *self.foreign)) or "noise"

    def save(self, file: Path) -> Path:
        file.write_text(json.dumps(asdict(self), indent=1), encoding="utf-8")
        return file

    @classmethod
    def load(cls, file: Path) -> RealTruth:
        content = json.loads(file.read_text(encoding="utf-8"))
        return cls(**content | {"tells": tuple(content["tells"])})


def names_of(hidden: str) -> tuple[str, ...]:
    """Every name that says a hidden thing; a beat that is off in some runs is one that is off."""
    plain = hidden.partition(":some runs")[0]
    return (hidden, plain, *SAME.get(plain, ()))
