"""Whether a diagnosis said the truth of a realistic case.

A name is true when what it says acts: the main effect, a small one, dirt, what differs from run to
run, or a name that says the same. Wrong inputs are told by a message that has a word of the fault.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fish_env.errors import DatasetError
from tests.hidden.realistic.budget import ALL
from tests.hidden.realistic.catalogue import MAIN_SIZES, NEUTRAL
from tests.hidden.realistic.truth import RealTruth, names_of
from tests.hidden.scoring import difference, holds
from tests.hidden.scoring import names_of as listed

NAMING = ("cause", "parameters", "partial", "inputs")
"""Verdicts whose causes are claimed. An ambiguous one claims that one of its sets is right."""
INPUTS, REFUSED = "inputs", "refused"
"""Verdicts that blame the inputs: a false name where these are right. Noise alone may be blamed."""


@dataclass(frozen=True)
class RealRow:
    """One scored case.

    Attributes:
        tier, seed, truth: which case, and what was hidden.
        strength: size of the main effect, 1 is typical.
        verdict: the answer; "refused" if the data were, "error" if there was none.
        named: causes named together.
        alternatives: other explanations given.
        claimed: all names that the answer stands for.
        false_names: those of them that are not true.
        main_named: the main effect is claimed, or in one of the ambiguous sets; None where there
            is no main effect.
        told: a suspect is claimed, or a message about the inputs is of it; None in other tiers.
        outside_right: of a foreign plant: outside the library, or in part with true names only;
            None in other tiers.
        nameable: every hidden effect has a name that an answer can give.
        errors: relative error of each parameter of the main effect, if it is named.
        covered: whether the 95 % interval of each such parameter holds the truth.
        budget_error: share of the main effect less its true share; None without a budget.
        budget_true: the true share.
        gain_share: share of the reachable gap that the extended model closed.
        runtime: s.
        error: what went wrong, if the diagnosis failed.
    """

    tier: str
    seed: int
    truth: str
    strength: float
    verdict: str
    named: tuple[str, ...] = ()
    alternatives: tuple[tuple[str, ...], ...] = ()
    claimed: tuple[str, ...] = ()
    false_names: tuple[str, ...] = ()
    main_named: bool | None = None
    told: bool | None = None
    outside_right: bool | None = None
    nameable: bool = True
    errors: dict[str, float] = field(default_factory=dict)
    covered: dict[str, bool] = field(default_factory=dict)
    budget_error: float | None = None
    budget_true: float | None = None
    gain_share: float | None = None
    runtime: float | None = None
    error: str = ""


def failed(truth: RealTruth, error: BaseException, trace: str) -> RealRow:
    """The row of a case whose diagnosis raised; a refusal of the data may tell what is wrong."""
    if isinstance(error, DatasetError):
        return score(truth, {"verdict": REFUSED, "inputs": [str(error)]})
    return score(truth, {"verdict": "error"}, error=trace)


def score(
    truth: RealTruth,
    diagnosis: Mapping[str, Any],
    catalogue: Collection[str] | None = None,
    error: str = "",
) -> RealRow:
    """Compares a diagnosis with the truth.

    Args:
        truth: what is hidden.
        diagnosis: the content of diagnosis.json.
        catalogue: names of effects that an answer can give; None: any.
        error: what went wrong.
    """
    verdict = str(diagnosis["verdict"])
    # Wrong inputs are put right, and the rest of the answer goes on from there.
    rest = str(diagnosis.get("verdict_once_corrected", verdict)) if verdict == INPUTS else verdict
    named = listed(diagnosis.get("causes", ()))
    alternatives = tuple(listed(other) for other in diagnosis.get("alternatives", ()))
    claimed = claims(truth, rest, named, alternatives)
    false = tuple(name for name in claimed if not truth.is_true(name))
    if verdict in (INPUTS, REFUSED) and truth.acting and not says(truth, diagnosis):
        false = (*false, verdict)
    errors, covered = main_errors(truth, rest, diagnosis)
    return RealRow(
        truth.tier,
        truth.seed,
        truth.label,
        truth.strength,
        verdict,
        named,
        alternatives,
        claimed,
        false,
        main_named=among(truth.main, rest, named, alternatives) if truth.main else None,
        told=told(truth, rest, named, alternatives, false, diagnosis) if truth.suspect else None,
        outside_right=outside_right(rest, claimed, false) if truth.foreign else None,
        nameable=nameable(truth, catalogue),
        errors=errors,
        covered=covered,
        budget_error=budget_error(truth, diagnosis),
        budget_true=main_share(truth),
        gain_share=((diagnosis.get("gain") or {}).get("share_of_reachable") or {}).get("estimate"),
        runtime=diagnosis.get("runtime_s"),
        error=error,
    )


def claims(
    truth: RealTruth,
    verdict: str,
    named: tuple[str, ...],
    alternatives: Sequence[tuple[str, ...]],
) -> tuple[str, ...]:
    """Names that an answer stands for: of one with alternatives those of its best explanation."""
    sets: Sequence[tuple[str, ...]] = [named, *alternatives] if verdict == "ambiguous" else ()
    if verdict == "partial":
        sets = alternatives  # each holds all that is named
    if sets:
        best = sorted(filter(None, sets), key=lambda s: sum(not truth.is_true(n) for n in s))
        return best[0] if best else ()
    return named if verdict in NAMING else ()


def among(
    hidden: Collection[str],
    verdict: str,
    named: tuple[str, ...],
    alternatives: Sequence[tuple[str, ...]],
) -> bool:
    """Whether one of the hidden effects is named, or is in an ambiguous set."""
    sets: Sequence[tuple[str, ...]] = [named] if verdict in NAMING else []
    if verdict in ("ambiguous", "partial"):
        sets = [named, *alternatives]
    said = {name for names in sets for name in names}
    return any(said & set(names_of(one)) for one in hidden)


def says(truth: RealTruth, diagnosis: Mapping[str, Any]) -> bool:
    """Whether a message about the inputs has a word of what is wrong with them."""
    text = json.dumps([blamed(entry) for entry in diagnosis.get("inputs") or ()], default=str)
    return any(re.search(rf"(?<!\w){re.escape(word)}s?(?!\w)", text) for word in truth.tells)


def blamed(entry: Any) -> Any:
    """What a message blames and would change, without what it compares that with."""
    if not isinstance(entry, Mapping) or "target" not in entry:
        return entry
    return [entry.get(key) for key in ("kind", "target", "fix", "alternatives")]


def told(
    truth: RealTruth,
    verdict: str,
    named: tuple[str, ...],
    alternatives: Sequence[tuple[str, ...]],
    false: tuple[str, ...],
    diagnosis: Mapping[str, Any],
) -> bool:
    """Whether a suspect is named or told; noise of another kind may also be lived with."""
    quiet = truth.benign and verdict == "no_misfit" and not false
    return quiet or says(truth, diagnosis) or among(truth.suspect, verdict, named, alternatives)


def outside_right(verdict: str, claimed: tuple[str, ...], false: tuple[str, ...]) -> bool:
    """Of physics that no catalogue has."""
    return verdict == "outside_library" or (verdict == "partial" and bool(claimed) and not false)


def nameable(truth: RealTruth, catalogue: Collection[str] | None) -> bool:
    """Whether what acts most or alone has a name that an answer can give.

    Coefficients always have. What cannot be named is outside the library for this answer.
    """
    if truth.foreign:
        return False
    if catalogue is None or truth.benign or truth.tells:
        return True
    return all(
        any(name in catalogue or name.startswith("parameter:") for name in names_of(hidden))
        for hidden in (*truth.main, *truth.suspect)
    )


def main_errors(
    truth: RealTruth, verdict: str, diagnosis: Mapping[str, Any]
) -> tuple[dict[str, float], dict[str, bool]]:
    """Relative errors and interval coverage of the sizes of the main effect, where it is named.

    A size is compared with its departure from neutral, but no less than a quarter of the typical;
    what is off at infinity with its value.
    """
    errors: dict[str, float] = {}
    covered: dict[str, bool] = {}
    if verdict not in (*NAMING, "ambiguous"):
        return errors, covered
    for cause in diagnosis.get("causes", ()):
        name = cause["name"]
        for key, true in truth.main.get(name, {}).items():
            given = cause.get("parameters", {}).get(key)
            if given is None or key not in MAIN_SIZES[name].typical:
                continue
            neutral, typical = NEUTRAL[name][key], MAIN_SIZES[name].typical[key]
            unit = abs(true)
            if np.isfinite(neutral):
                unit = max(abs(true - neutral), 0.25 * abs(typical - neutral))
            errors[f"{name}.{key}"] = abs(difference(given["estimate"], true, False)) / unit
            if given.get("ci95"):
                covered[f"{name}.{key}"] = holds(given["ci95"], true, False)
    return errors, covered


def main_share(truth: RealTruth) -> float | None:
    """True share of the main effect in the misfit of the nominal simulation."""
    return sum(truth.budget[name][ALL] for name in truth.main) if truth.budget else None


def budget_error(truth: RealTruth, diagnosis: Mapping[str, Any]) -> float | None:
    """Share of the main effect in the published budget less the true one; absent means none."""
    true, published = main_share(truth), diagnosis.get("budget")
    entries = published.get("shares") if isinstance(published, Mapping) else published
    if true is None or not entries:
        return None
    same = {name for hidden in truth.main for name in names_of(hidden)}
    return sum(float(entry["share"]) for entry in entries if entry["name"] in same) - true
