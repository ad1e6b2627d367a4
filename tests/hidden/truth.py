"""What is hidden in a case: kept beside the dataset's folder, never in it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tests.hidden.sizes import ABSORBED, EQUIVALENT, INVISIBLE

Values = dict[str, dict[str, float]]


@dataclass(frozen=True)
class Truth:
    """The answer to one case.

    Attributes:
        tier: which kind of case.
        seed: its number.
        fish: nominal fish that the dataset names.
        effects: catalogue effects that act, with their parameters.
        foreign: effects outside the catalogue that act.
        moved: baseline coefficients off by more than their prior, by path.
        strength: size of the effects, 1 is typical.
        visible: whether the runs can show the effects at all.
        coefficients: every number of the true fish, by path.
        disturbance: colour, force, time constant and frame of the random push.
        noise: one-sigma sensor noise by channel.
        about: anything else worth knowing of the case.
    """

    tier: str
    seed: int
    fish: str
    effects: Values = field(default_factory=dict)
    foreign: Values = field(default_factory=dict)
    moved: dict[str, float] = field(default_factory=dict)
    strength: float = 1.0
    visible: bool = True
    coefficients: dict[str, float] = field(default_factory=dict)
    disturbance: dict[str, Any] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Verdicts that are right."""
        if self.foreign:
            return ("outside_library",)
        if not self.visible:
            return ("not_excited", "no_misfit")
        if self.moved:
            return ("parameters",)
        if not self.effects:
            return ("no_misfit",)
        verdicts = ["cause"]
        if any(name in EQUIVALENT for name in self.effects):
            verdicts.append("parameters")
        if all(name in ABSORBED for name in self.effects):
            verdicts.append("no_misfit")
        return tuple(verdicts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names that a right answer gives, sorted."""
        return tuple(sorted([*self.effects, *(f"parameter:{path}" for path in self.moved)]))

    @property
    def equivalent(self) -> dict[str, tuple[str, ...]]:
        """Other names that say exactly the same, by name."""
        return {name: EQUIVALENT[name] for name in self.names if name in EQUIVALENT}

    @property
    def label(self) -> str:
        """Row of the confusion matrix."""
        if self.foreign:
            return " + ".join(sorted(self.foreign)) + " (outside)"
        return " + ".join(self.names) or "nothing"

    def save(self, file: Path) -> Path:
        file.write_text(json.dumps(asdict(self), indent=1), encoding="utf-8")
        return file

    @classmethod
    def load(cls, file: Path) -> Truth:
        return cls(**json.loads(file.read_text(encoding="utf-8")))


def hidden_from_all(names: tuple[str, ...]) -> bool:
    """Whether no run whatever could show these effects."""
    return bool(names) and all(name in INVISIBLE for name in names)
