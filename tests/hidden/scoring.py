"""Whether a diagnosis found what was hidden."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fish_env.params import load_fish
from tests.hidden.records import LIBRARY
from tests.hidden.sizes import SIZES
from tests.hidden.truth import Truth

NAMING = ("cause", "parameters")
QUIET = ("no_misfit", "not_excited")


@dataclass(frozen=True)
class Row:
    """One scored case.

    Attributes:
        tier, seed, truth: which case, and what was hidden.
        strength: size of what was hidden, 1 is typical.
        verdict: the answer; "error" if there was none.
        named: causes named together.
        alternatives: other explanations given.
        verdict_right: the verdict is one that the truth allows.
        name_right: and the names are exactly those hidden, or say the same.
        set_right: the truth is among the explanations of an ambiguous answer.
        partial: some hidden effect is named, but not exactly the hidden ones.
        wrong_single: one cause alone is named with confidence, and it does not act.
        false_alarm: something is claimed where nothing is hidden.
        above_detectable: hidden size over the published smallest detectable one; None if none
            was published.
        errors: relative error of each parameter of causes rightly named.
        shape_errors: the same of parameters that say where or when, not how much.
        covered: whether the 95 % interval of each such parameter holds the truth.
        coefficients_covered, coefficients: intervals of baseline coefficients that hold the
            truth, out of how many.
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
    verdict_right: bool = False
    name_right: bool = False
    set_right: bool = False
    partial: bool = False
    wrong_single: bool = False
    false_alarm: bool = False
    above_detectable: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    shape_errors: dict[str, float] = field(default_factory=dict)
    covered: dict[str, bool] = field(default_factory=dict)
    coefficients_covered: int = 0
    coefficients: int = 0
    gain_share: float | None = None
    runtime: float | None = None
    error: str = ""


def failed(truth: Truth, error: str) -> Row:
    """The row of a case whose diagnosis raised."""
    return Row(truth.tier, truth.seed, truth.label, truth.strength, "error", error=error)


def score(truth: Truth, diagnosis: Mapping[str, Any]) -> Row:
    """Compares a diagnosis, the content of diagnosis.json, with the truth."""
    verdict = str(diagnosis["verdict"])
    named = names_of(diagnosis.get("causes", ()))
    alternatives = tuple(names_of(other) for other in diagnosis.get("alternatives", ()))
    verdict_right = verdict in truth.verdicts and admits(truth, verdict, diagnosis)
    right_names = same_names(truth, named)
    single = verdict in NAMING and len(named) == 1
    errors, shape_errors, covered = parameter_errors(truth, diagnosis)
    held, total = coefficient_coverage(truth, diagnosis)
    return Row(
        tier=truth.tier,
        seed=truth.seed,
        truth=truth.label,
        strength=truth.strength,
        verdict=verdict,
        named=named,
        alternatives=alternatives,
        verdict_right=verdict_right,
        name_right=verdict_right and (right_names or verdict not in NAMING),
        set_right=verdict == "ambiguous"
        and any(same_names(truth, names) for names in (named, *alternatives)),
        partial=verdict in NAMING and not right_names and any(acts(truth, n) for n in named),
        wrong_single=single and not acts(truth, named[0]),
        false_alarm=truth.verdicts == ("no_misfit",) and verdict not in QUIET,
        above_detectable=detectable_ratio(truth, diagnosis),
        errors=errors,
        shape_errors=shape_errors,
        covered=covered,
        coefficients_covered=held,
        coefficients=total,
        gain_share=gain_share(diagnosis),
        runtime=diagnosis.get("runtime_s"),
    )


def names_of(causes: Iterable[Mapping[str, Any]]) -> tuple[str, ...]:
    """Names of a list of causes, sorted."""
    return tuple(sorted(str(cause["name"]) for cause in causes))


def acts(truth: Truth, name: str) -> bool:
    """Whether a named cause is one of the hidden ones, or says the same."""
    return any(name in (hidden, *truth.equivalent.get(hidden, ())) for hidden in truth.names)


def same_names(truth: Truth, named: tuple[str, ...]) -> bool:
    """Whether every hidden effect is named, by its own name or an equal one, and nothing else."""
    every = all(
        any(name in (hidden, *truth.equivalent.get(hidden, ())) for name in named)
        for hidden in truth.names
    )
    return bool(truth.names) and every and all(acts(truth, name) for name in named)


def admits(truth: Truth, verdict: str, diagnosis: Mapping[str, Any]) -> bool:
    """Of an effect that the runs cannot show, "no misfit" must add that it was not excited."""
    if truth.visible or verdict != "no_misfit":
        return True
    said = {entry["name"]: entry for entry in diagnosis.get("preconditions", ())}
    return all(said.get(name, {}).get("excited") is False for name in truth.effects)


def detectable_ratio(truth: Truth, diagnosis: Mapping[str, Any]) -> float | None:
    """Largest ratio of a hidden departure to its smallest detectable one; the least of causes."""
    said = {entry["name"]: entry for entry in diagnosis.get("preconditions", ())}
    ratios = []
    for name, values in truth.effects.items():
        smallest = said.get(name, {}).get("smallest_detectable") or {}
        known = [
            multiple(name, key, values[key], size)
            for key, size in smallest.items()
            if key in values and size and math.isfinite(size)
        ]
        if not known:
            return None
        ratios.append(max(known))
    coefficients = {entry["name"]: entry for entry in diagnosis.get("parameters", ())}
    for path, value in truth.moved.items():
        said_of = coefficients.get(f"parameter:{path}", {})
        if not said_of.get("smallest_detectable"):
            return None
        ratios.append(abs(value - said_of["nominal"]) / said_of["smallest_detectable"])
    return min(ratios) if ratios else None


def multiple(effect: str, key: str, value: float, size: float) -> float:
    """How many times the size a parameter is; what is off at infinity acts the more the less it is.

    A rate limit of 3 rad/s is twice what can just be found if that is one of 6 rad/s.
    """
    return (
        departure(effect, key, value) / size
        if math.isfinite(LIBRARY[effect][key])
        else size / value
    )


def departure(effect: str, key: str, value: float) -> float:
    """How far a parameter is from doing nothing; an infinite neutral value counts as the value."""
    neutral = LIBRARY[effect][key]
    return abs(value - neutral) if math.isfinite(neutral) else abs(value)


def parameter_errors(
    truth: Truth, diagnosis: Mapping[str, Any]
) -> tuple[dict[str, float], dict[str, float], dict[str, bool]]:
    """Relative errors of sizes and of shapes, and interval coverage, of rightly named effects."""
    errors: dict[str, float] = {}
    shapes: dict[str, float] = {}
    covered: dict[str, bool] = {}
    for cause in diagnosis.get("causes", ()):
        name = cause["name"]
        if name in truth.effects:
            for key, true in truth.effects[name].items():
                given = cause.get("parameters", {}).get(key)
                if given is None:
                    continue
                target = errors if key in SIZES[name].typical else shapes
                wrap = key == "phase"
                away = difference(given["estimate"], true, wrap)
                target[f"{name}.{key}"] = abs(away) / unit_of(name, key, true)
                if given.get("ci95"):
                    covered[f"{name}.{key}"] = holds(given["ci95"], true, wrap)
        elif name.removeprefix("parameter:") in truth.moved:
            path = name.removeprefix("parameter:")
            moved = abs(truth.moved[path] - load_fish(truth.fish).get(path))
            for entry in diagnosis.get("parameters", ()):
                if entry["name"] == name:
                    errors[name] = abs(entry["estimate"] - truth.moved[path]) / moved
    return errors, shapes, covered


def difference(estimate: float, true: float, wrap: bool) -> float:
    return math.remainder(estimate - true, 2.0 * math.pi) if wrap else estimate - true


def holds(interval: Iterable[float], true: float, wrap: bool) -> bool:
    low, high = interval
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return abs(difference(middle, true, wrap)) <= half


def unit_of(effect: str, key: str, true: float) -> float:
    """What an error is relative to: the departure, but no less than a quarter of the typical.

    For a parameter of shape: a metre, a radian, or the value itself.
    """
    typical = SIZES[effect].typical
    if key in typical:
        return max(departure(effect, key, true), 0.25 * departure(effect, key, typical[key]))
    return 1.0 if key in ("x", "y", "z", "phase") else abs(true)


def coefficient_coverage(truth: Truth, diagnosis: Mapping[str, Any]) -> tuple[int, int]:
    """How many intervals of baseline coefficients hold the true value, out of how many.

    Only asked where the model in use has the right structure.
    """
    named = names_of(diagnosis.get("causes", ()))
    if truth.foreign or (truth.effects and not same_names(truth, named)):
        return 0, 0
    asked = [
        (entry["ci95"], truth.coefficients[entry["name"].removeprefix("parameter:")])
        for entry in diagnosis.get("parameters", ())
        if entry.get("ci95") and entry["name"].removeprefix("parameter:") in truth.coefficients
    ]
    return sum(low <= true <= high for (low, high), true in asked), len(asked)


def gain_share(diagnosis: Mapping[str, Any]) -> float | None:
    share = (diagnosis.get("gain") or {}).get("share_of_reachable") or {}
    return share.get("estimate")
