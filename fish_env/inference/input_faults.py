"""What is wrong with what an inference was given: a type that every check reports in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

LONGEST = 90
"""Characters of a line that a sentence can hold; one that names many runs is longer."""


@dataclass(frozen=True)
class InputFault:
    """One mistake in the data or in their description.

    Attributes:
        kind: "sign", "unit", "swap", "frame", "offset", "clock", "clock_skew", "clock_offset",
            "beat", "derived" or "silence".
        target: columns, or the clock, that it is about.
        value: sign, factor, scale or offset that puts it right; None where there is no number.
        unit: of the value.
        interval: 95 % interval of the value; None where it is exact.
        p: bound on the probability of as much evidence by chance, over all tests that were made; of
            silence, that noise alone shows as strong a sign of motion.
        log_evidence: log likelihood that putting it right gains; None where p is from a test.
        fix: the line of the description to write; empty where the vehicle itself does so.
        words: what is wrong, a clause.
        comparison: what the mistake shows in.
        before: disagreement in that as declared: 0 the same, 1 unrelated, 2 opposite.
        after: disagreement once it is put right.
        alternatives: other fixes that explain the data as well.
        decisive: whether neither chance nor another sign or scale can have made it.
        binds: whether no other verdict can stand beside it.
        corrected: whether the rest of the answer was made with it put right.
    """

    kind: str
    target: str
    value: float | None
    unit: str
    interval: tuple[float, float] | None
    p: float
    log_evidence: float | None
    fix: str
    words: str
    comparison: str
    before: float | None
    after: float | None
    alternatives: tuple[str, ...] = ()
    decisive: bool = True
    binds: bool = True
    corrected: bool = True

    @property
    def said(self) -> str:
        """The fault in one or two sentences: what, what to change, what that gains."""
        # A column keeps its name as it is.
        named = self.words.split()[0].strip(",") in self.target.replace(",", " ").split()
        begin = self.words[0] if named else self.words[0].upper()
        first = f"{begin}{self.words[1:]}{self._range}."
        if not self.fix:
            return first
        fixes = [self.fix, *self.alternatives] if self.decisive else [self.fix]
        short = [f"`{fix}`" for fix in fixes if len(fix) <= LONGEST]
        written = ", or ".join(short) or "what `fix` says under `inputs` in diagnosis.json"
        second = f" Write {written}"
        if not self.decisive:
            second = f" This is not certain; if it is so, write {written}"
        return f"{first}{second}{self._gain}."

    @property
    def _range(self) -> str:
        if self.interval is None:
            return ""
        low, high = self.interval
        return f" (95 %: {low:.5g} to {high:.5g}{f' {self.unit}' if self.unit != '-' else ''})"

    @property
    def _gain(self) -> str:
        if self.before is None or self.after is None:
            return ""
        return (
            f"; the disagreement of {self.comparison} falls from {self.before:.2g} to "
            f"{self.after:.2g} (0: the same, 1: unrelated, 2: opposite)"
        )

    def as_dict(self) -> Mapping[str, Any]:
        """Plain data for ``diagnosis.json``."""
        gain = {"in": self.comparison, "before": self.before, "after": self.after}
        return {
            "kind": self.kind,
            "target": self.target,
            "value": self.value,
            "unit": self.unit,
            "ci95": list(self.interval) if self.interval else None,
            "p": self.p,
            "log_evidence": self.log_evidence,
            "fix": self.fix,
            "alternatives": list(self.alternatives),
            "gain": gain if self.before is not None else None,
            "decisive": self.decisive,
            "binds": self.binds,
            "corrected": self.corrected,
            "words": self.said,
        }
