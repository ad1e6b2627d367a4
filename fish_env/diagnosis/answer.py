"""A diagnosis as plain data, in the form ``robofish-diagnosis/1`` of ``diagnosis.json``."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import pstdev

from fish_env.data.schema import Dataset
from fish_env.diagnosis.entries import (
    FORMAT,
    Plain,
    budget_entry,
    cause_entry,
    coefficient_entries,
    disturbance_entry,
    experiment_entry,
    gain_entry,
    misfit_entry,
    precondition_entry,
    residual_entry,
)
from fish_env.diagnosis.input_checks import doubts
from fish_env.diagnosis.regimes import as_plain
from fish_env.diagnosis.result import Diagnosed, Diagnosis
from fish_env.identification.beats import beats_of, by_run, uneven
from fish_env.identification.generic_forces import wrench_unit
from fish_env.identification.own_beats import USUAL_BEAT
from fish_env.identification.series import series_of
from fish_env.inference.attribution import Ranked
from fish_env.inference.effort import effort_of
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import PARAMETER
from fish_env.inference.policy import POLICY
from fish_env.inference.probes import coefficient_sizes
from fish_env.inference.screening import smallest_detectable
from fish_env.rigidbody import consistency, noise_floor, outliers
from fish_env.version import VERSION


def as_dict(diagnosis: Diagnosis) -> Plain:
    """Everything that ``diagnosis.json`` holds of runs over time."""
    binds = diagnosis.inputs.binding
    answer = {
        **shared_entries(diagnosis),
        "verdict": "inputs" if binds else diagnosis.verdict.name,
        "inputs": diagnosis.inputs.as_list(),
        "verdict_once_corrected": diagnosis.verdict.name,
        "fish": diagnosis.problem.fish.name,
        "left_out": list(effort_of(diagnosis.quick).left_out),
        "noise": _noise(diagnosis.accepted),
        "noise_floor": _floors(diagnosis),
        "outliers": outliers.as_dict(diagnosis.outliers),
        "consistency": consistency.as_dict(diagnosis.consistency),
        "beats": _beats(diagnosis.inputs.logged),
        "gain": gain_entry(diagnosis.gain),
        "localisation": as_plain(diagnosis.localisation),
        "residual_model": residual_entry(diagnosis.residual),
        "notes": [*diagnosis.dataset.notes, *_chance(diagnosis)],
    }
    return {**answer, "doubts": doubts(answer)}


def shared_entries(diagnosis: Diagnosed) -> Plain:
    """What ``diagnosis.json`` holds of every diagnosis."""
    verdict, attribution = diagnosis.verdict, diagnosis.attribution
    alternatives = [
        [cause_entry(rival.fit, name) for name in rival.causes]
        for rival in attribution.rivals
        if rival.causes in verdict.alternatives
    ]
    screen = attribution.screens[0]
    sizes = coefficient_sizes(screen.signals, lambda s: smallest_detectable(s, 0, screen.threshold))
    return {
        "format": FORMAT,
        "version": VERSION,
        "dataset": diagnosis.dataset.name,
        "seed": diagnosis.seed,
        "quick": diagnosis.quick,
        "policy": POLICY.as_dict(),
        "runtime_s": diagnosis.runtime_s,
        "verdict": verdict.name,
        "causes": [cause_entry(diagnosis.accepted, name) for name in verdict.causes],
        "alternatives": alternatives,
        "parameters": coefficient_entries(diagnosis.accepted, sizes),
        "run_variation": run_variation_entry(diagnosis.accepted),
        "budget": budget_entry(diagnosis.budget),
        "misfit": misfit_entry(diagnosis.misfit),
        "fitted_runs": diagnosis.accepted.problem.run_count,
        "preconditions": [precondition_entry(p) for p in diagnosis.preconditions],
        "ranking": [_rank(ranked) for ranked in attribution.ranking],
        "unexplained": [] if diagnosis.adequacy.reached else _unexplained(diagnosis),
        "next_experiment": experiment_entry(diagnosis.next_experiment),
        "strained": list(diagnosis.adequacy.implausible),
    }


def _beats(dataset: Dataset) -> Plain:
    """Measured over commanded tail frequency of each run that shows it."""
    beats = beats_of(dataset)
    runs = {run: {"ratio": ratio, "sd": sd} for run, (ratio, sd) in by_run(beats).items()}
    return {"uneven": uneven(beats), "runs": runs}


def _rank(ranked: Ranked) -> Plain:
    return {"name": ranked.name, "score": ranked.score, "ci95": list(ranked.interval)}


def _noise(fit: Fit) -> Plain:
    sensors = zip(series_of(fit).channels, fit.noise.sensor_sd.tolist(), strict=True)
    return {
        "sensor_sd": dict(sensors),
        "disturbance": disturbance_entry(fit.noise),
    }


def _floors(diagnosis: Diagnosis) -> list[Plain]:
    """Noise of each channel from the data alone, beside what the filter of the answer uses."""
    used = _noise(diagnosis.accepted)["sensor_sd"]
    floors = map(noise_floor.as_dict, diagnosis.floors)
    return [{**floor, "filter_sd": used.get(floor["channel"])} for floor in floors]


def run_variation_entry(fit: Fit) -> list[Plain]:
    """What the runs differ in: spread over runs beside the usual one, and each run's value."""
    problem, entries = fit.problem, []
    for i, known in enumerate(problem.variations):
        sd = float(fit.noise.spread[i])
        if sd > 0.0:
            values = problem.variation[:, i].tolist()
            entries.append(
                {"name": known.name, "unit": known.unit, "sd": sd, "usual_sd": known.usual,
                 "beyond_usual": sd > POLICY.beyond_usual * known.usual, "values": values}
            )  # fmt: skip
    return [*_own_beats(fit), *entries]


def _own_beats(fit: Fit) -> list[Plain]:
    """Spread of the tail's frequency over runs, where they differ in it."""
    beats = [run.own_beat for run in getattr(fit.problem, "runs", ())]
    if all(beat == 1.0 for beat in beats):
        return []
    sd = pstdev(beats)
    return [
        {"name": "beat", "unit": "1", "sd": sd, "usual_sd": USUAL_BEAT,
         "beyond_usual": sd > POLICY.beyond_usual * USUAL_BEAT, "values": beats}
    ]  # fmt: skip


def _unexplained(diagnosis: Diagnosed) -> list[Plain]:
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
    if answer["verdict"] == "inputs":
        rest = words(
            {**answer, "verdict": answer.get("verdict_once_corrected", "no_misfit"), "inputs": []}
        )
        return f"{_inputs(answer)} With that put right: {rest}"
    told = _inputs(answer)
    return f"{told} {_said(answer)}" if told else _said(answer)


def _inputs(answer: Plain) -> str:
    """What is wrong with the data, in sentences."""
    return " ".join(fault["words"] for fault in answer.get("inputs", ()) if fault["decisive"])


def _said(answer: Plain) -> str:
    """The verdict on the model, in sentences."""
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
        "partial": (
            "These known causes act, beside something that no known cause explains: "
            f"{_named(answer)}.",
            _gained(answer),
            _asked(answer),
        ),
        "outside_library": (
            "Something is missing that none of the known causes explains.",
            _asked(answer),
        ),
    }
    sentences = (_doubt(answer), *say[answer["verdict"]], _budgeted(answer))
    return " ".join(sentence for sentence in sentences if sentence)


def _doubt(answer: Plain) -> str:
    """What speaks against a named answer, ahead of it."""
    share = ((answer.get("gain") or {}).get("share_of_reachable") or {}).get("estimate")
    if not answer["causes"] or share is None or share >= POLICY.least_share:
        return ""
    if share <= 0.0:
        return "Doubtful: held-out runs are predicted no better with what is named here."
    return (
        f"Doubtful: what is named here closes {100 * share:.0f} % of the gap to the noise on "
        "held-out runs."
    )


def _budgeted(answer: Plain) -> str:
    """The error budget in one sentence."""
    budget = answer.get("budget")
    if not budget:
        return ""
    names = {
        "coefficients": "re-estimated coefficients",
        "run_variation": "what the runs differ in",
    }
    parts = [
        f"{100 * max(entry['share'], 0.0):.0f} % goes with "
        f"{names.get(entry['name'], entry['name'].removeprefix(PARAMETER))}"
        for entry in budget["shares"]
    ]
    where = "held-out runs" if budget["held_out"] else "the fitted runs"
    left = 100 * max(budget["left"], 0.0)
    return (
        f"Of the misfit of the nominal simulation on {where}, {', '.join(parts)}; "
        f"{left:.0f} % is left."
    )


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
