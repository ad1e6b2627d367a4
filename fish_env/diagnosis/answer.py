"""A diagnosis as plain data, in the form ``robofish-diagnosis/1`` of ``diagnosis.json``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fish_env.data.schema import Dataset
from fish_env.diagnosis import consistency, noise_floor
from fish_env.diagnosis.attribution import Ranked
from fish_env.diagnosis.beats import beats_of, by_run, uneven
from fish_env.diagnosis.causes import PARAMETER, coefficient_sizes
from fish_env.diagnosis.effort import effort_of
from fish_env.diagnosis.entries import (
    FORMAT,
    Plain,
    cause_entry,
    coefficient_entries,
    disturbance_entry,
    experiment_entry,
    gain_entry,
    misfit_entry,
    precondition_entry,
    residual_entry,
)
from fish_env.diagnosis.generic_forces import wrench_unit
from fish_env.diagnosis.regimes import as_plain
from fish_env.diagnosis.screening import smallest_detectable
from fish_env.diagnosis.suitability import doubts
from fish_env.identification.estimator import Fit

if TYPE_CHECKING:
    from fish_env.diagnosis.pipeline import Diagnosis


def as_dict(diagnosis: Diagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds."""
    verdict = diagnosis.verdict
    alternatives = [
        [cause_entry(rival.fit, name) for name in rival.causes]
        for rival in diagnosis.attribution.rivals
        if rival.causes in verdict.alternatives
    ]
    screen = diagnosis.attribution.screens[0]
    sizes = coefficient_sizes(screen.signals, lambda s: smallest_detectable(s, 0, screen.threshold))
    answer = {
        "format": FORMAT,
        "dataset": diagnosis.dataset.name,
        "fish": diagnosis.problem.fish.name,
        "seed": diagnosis.seed,
        "quick": diagnosis.quick,
        "left_out": list(effort_of(diagnosis.quick).left_out),
        "runtime_s": diagnosis.runtime_s,
        "verdict": verdict.name,
        "causes": [cause_entry(diagnosis.accepted, name) for name in verdict.causes],
        "alternatives": alternatives,
        "parameters": coefficient_entries(diagnosis.accepted, sizes),
        "noise": _noise(diagnosis.accepted),
        "noise_floor": [noise_floor.as_dict(floor) for floor in diagnosis.floors],
        "consistency": consistency.as_dict(diagnosis.consistency),
        "beats": _beats(diagnosis.dataset),
        "misfit": misfit_entry(diagnosis.misfit),
        "gain": gain_entry(diagnosis.gain),
        "preconditions": [precondition_entry(p) for p in diagnosis.preconditions],
        "ranking": [_rank(ranked) for ranked in diagnosis.attribution.ranking],
        "localisation": as_plain(diagnosis.localisation),
        "unexplained": [] if diagnosis.adequacy.reached else _unexplained(diagnosis),
        "residual_model": residual_entry(diagnosis.residual),
        "next_experiment": experiment_entry(diagnosis.next_experiment),
        "strained": list(diagnosis.adequacy.strained),
        "notes": [*diagnosis.dataset.notes, *_chance(diagnosis)],
    }
    return {**answer, "doubts": doubts(answer)}


def _beats(dataset: Dataset) -> Plain:
    """Measured over commanded tail frequency of each run that shows it."""
    beats = beats_of(dataset)
    runs = {run: {"ratio": ratio, "sd": sd} for run, (ratio, sd) in by_run(beats).items()}
    return {"uneven": uneven(beats), "runs": runs}


def _rank(ranked: Ranked) -> Plain:
    return {"name": ranked.name, "score": ranked.score, "ci95": list(ranked.interval)}


def _noise(fit: Fit) -> Plain:
    sensors = zip(fit.problem.channels, fit.noise.sensor_sd.tolist(), strict=True)
    return {
        "sensor_sd": dict(sensors),
        "disturbance": disturbance_entry(fit.noise),
    }


def _unexplained(diagnosis: Diagnosis) -> list[Plain]:
    """Forces the data still ask for, over and above the best explanation."""
    return [
        {"depends_on": m.function, "direction": m.direction, "rms": float(m.size), "log_p": m.log_p}
        for m in diagnosis.adequacy.misfits
    ]


def _chance(diagnosis: Diagnosis) -> list[str]:
    """What was asked for by the fitted runs, and is no good for the others."""
    gain = diagnosis.adequacy.refuted
    if gain is None:
        return []
    asked = _unexplained(diagnosis)[0]
    return [
        f"The runs that were fitted ask for {_wrench(asked)} ({asked['rms']:.2g} "
        f"{wrench_unit(asked['direction'])}), hardly louder than chance does; as it foretells the "
        f"final runs no better (log likelihood {gain:+.2g}), it is taken for chance."
    ]


def words(answer: Plain) -> str:
    """The verdict in two sentences for somebody who builds robots."""
    say: dict[str, Sequence[str]] = {
        "no_misfit": (
            "The simulation explains these runs down to the noise once its coefficients are "
            "fitted within what was known of them.",
            _blind(answer),
        ),
        "not_excited": (
            "Nothing is seen to be wrong, but these runs could not show most causes.",
            _blind(answer),
        ),
        "parameters": (
            f"The structure of the model holds, but its numbers do not: {_named(answer)}.",
            _gained(answer),
        ),
        "cause": (f"The simulation lacks {_named(answer)}.", _gained(answer)),
        "ambiguous": (
            f"Something is missing, and these runs cannot tell {_named(answer)} from "
            f"{_others(answer)}.",
            "Fly the next experiment to separate them.",
        ),
        "outside_library": (
            "Something is missing that none of the known causes explains.",
            _asked(answer),
        ),
    }
    return " ".join(sentence for sentence in say[answer["verdict"]] if sentence)


def _named(answer: Plain) -> str:
    return " and ".join(_one(cause) for cause in answer["causes"])


def _one(cause: Plain) -> str:
    name = cause["name"].removeprefix(PARAMETER)
    values = ", ".join(
        f"{key} {p['estimate']:.3g} ({p['ci95'][0]:.3g} to {p['ci95'][1]:.3g}) {p['unit']}".rstrip()
        for key, p in cause["parameters"].items()
    )
    return f"{name} [{values}]"


def _others(answer: Plain) -> str:
    return " or from ".join(" and ".join(map(_one, other)) for other in answer["alternatives"])


def _gained(answer: Plain) -> str:
    gain = answer["gain"]
    if not gain:
        return "There were too few runs to keep some for judging the gain."
    fit = gain["fit_percent"]
    return (
        f"On {_judged(answer)} fit {fit['extended']:.0f} % with it and "
        f"{fit['baseline']:.0f} % without."
    )


def _judged(answer: Plain) -> str:
    if answer.get("kind") == "steady":
        return "conditions kept for judging, predicted averages"
    return "runs kept for judging, predictions over 3 s"


def _blind(answer: Plain) -> str:
    blind = [p["name"] for p in answer["preconditions"] if not p["excited"]]
    if not blind:
        return "Every known cause of a plausible size would have been found."
    return f"They could not have shown: {', '.join(blind)}."


def _asked(answer: Plain) -> str:
    if not answer["unexplained"]:
        return ""
    holds = holds_elsewhere(answer)
    first = answer["residual_model"]["terms"][0] if holds else answer["unexplained"][0]
    also = ", on runs kept for judging too" if holds else ""
    return f"What is left looks most like {_wrench(first)}{also}."


def _wrench(term: Plain) -> str:
    """One wrench in words."""
    kind = "force" if wrench_unit(term["direction"]) == "N" else "moment"
    return f"a {kind} in {term['direction']} that depends on {term['depends_on']}"


def holds_elsewhere(answer: Plain) -> bool:
    """Whether the empirical model of what is left foretells runs that did not choose it."""
    gain = (answer.get("residual_model") or {}).get("gain")
    return bool(gain and gain["log_likelihood"]["ci95"][0] > 0.0)
