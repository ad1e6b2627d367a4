"""The answer of a diagnosis in four lines: verdict, closed share of the gap, next step, caveats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fish_env.inference.hypotheses import short_name
from fish_env.inference.policy import POLICY

Answer = Mapping[str, Any]
EXPERIMENT_FILE = "next_experiment.csv"
MOST_NAMED = 3
"""Causes that are told with their values, and values of one cause."""
LONGEST_FIX = 160
"""Longest lines to write that the next step quotes, in characters."""


@dataclass(frozen=True)
class Headline:
    """What a reader sees first.

    Attributes:
        verdict: What is wrong with the simulation, in one sentence.
        closed: How much of the gap between the refitted simulation and the noise is closed.
        next_step: What to do next.
        caveats: What limits the answer, in one line; empty where nothing does.
    """

    verdict: str
    closed: str
    next_step: str
    caveats: str

    @property
    def lines(self) -> tuple[str, ...]:
        """All lines that say something, in the order of reading."""
        said = (self.verdict, self.closed, f"Next: {self.next_step}", self.caveats)
        return tuple(line for line in said if line)


def headline(answer: Answer) -> Headline:
    """The first lines of a report.

    Args:
        answer: Content of ``diagnosis.json``; what it lacks is left out.
    """
    return Headline(_verdict(answer), _closed(answer), _next_step(answer), _caveats(answer))


def facts(answer: Answer) -> str:
    """Verdict, data and fish in one line of names."""
    named = ("verdict", "dataset", "fish")
    return " · ".join(f"{word} {answer.get(word, '?')}" for word in named)


def enough_runs(count: int) -> bool:
    """Whether an interval over so many runs is shown: the same limit as in the error budget."""
    return count >= POLICY.fewest_runs_for_interval


def interval_of(share: Mapping[str, Any], runs: int) -> str:
    """The interval of a share in per cent, in words; nothing without one.

    Args:
        share: entry with its ends; older answers have ends of fewer than enough runs too.
        runs: over how many.
    """
    if not share["ci95"] or not enough_runs(runs):
        return ""
    low, high = (100.0 * end for end in share["ci95"])
    return f"{low:.0f} to {high:.0f} %"


def many_fitted(answer: Answer) -> bool:
    """Whether enough runs were fitted for intervals over them; older answers do not say."""
    return enough_runs(int(answer.get("fitted_runs", POLICY.fewest_runs_for_interval)))


def _verdict(answer: Answer) -> str:
    if answer["verdict"] == "inputs":
        faults = [fault for fault in answer.get("inputs", ()) if fault["decisive"]]
        told = " ".join(fault["words"].partition(" Write ")[0] for fault in faults)
        if faults and not any(fault["fix"] for fault in faults):
            return told
        rest = _verdict({**answer, "verdict": answer.get("verdict_once_corrected", "no_misfit")})
        return f"{told or 'The data or their description are wrong.'} Once corrected: {rest}"
    named = _named(answer["causes"])
    said = {
        "no_misfit": "No model error is detectable in these data.",
        "not_excited": "No model error is detectable, but these data could not show most effects.",
        "parameters": f"The structure of the model holds, but its numbers are wrong: {named}.",
        "cause": f"The simulation lacks {named}.",
        "ambiguous": f"The simulation lacks {_either(answer['causes'], answer['alternatives'])}.",
        "partial": f"The simulation lacks {_known(answer)}, and something that no known effect "
        "explains.",
        "outside_library": "Something is missing that no known effect explains.",
    }[answer["verdict"]]
    return f"Doubtful: {said[0].lower()}{said[1:]}" if _doubtful(answer) else said


def _named(causes: Sequence[Answer]) -> str:
    """Causes with their values, or of many the names: a table below has the values."""
    few = len(causes) <= MOST_NAMED
    return _joined([_cause(c) if few else short_name(c["name"]) for c in causes], "and")


def _known(answer: Answer) -> str:
    """Causes beside something unknown, with those of which one acts."""
    alternatives = answer["alternatives"]
    if not alternatives:
        return _named(answer["causes"])
    return f"{_either(alternatives[0], alternatives[1:])} (these data do not tell which)"


def _either(causes: Sequence[Answer], alternatives: Sequence[Sequence[Answer]]) -> str:
    """Explanations that the data cannot tell apart: what they share, and then where they differ."""
    every = [causes, *alternatives]
    common = set.intersection(*({cause["name"] for cause in one} for one in every))
    own = [[cause for cause in one if cause["name"] not in common] for one in every]
    shared = [cause for cause in causes if cause["name"] in common]
    if not shared or not all(own):
        return f"{_named(causes)}, or instead {_joined(map(_named, alternatives), 'or')}"
    return f"{_named(shared)}, and either {_joined(map(_named, own), 'or')}"


def _cause(cause: Answer) -> str:
    name = short_name(cause["name"])
    values = [
        f"{'' if key == 'value' else key.replace('_', ' ') + ' '}{p['estimate']:.3g} "
        f"{'' if p['unit'] in ('-', '1') else p['unit']}".strip()
        for key, p in cause["parameters"].items()
    ]
    shown = ", ".join(values[:MOST_NAMED]) + (", …" if len(values) > MOST_NAMED else "")
    return f"{name} ({shown})" if shown else name


def _joined(parts: Any, word: str) -> str:
    *first, last = list(parts) or [""]
    return f"{', '.join(first)} {word} {last}" if first else last


def _closed(answer: Answer) -> str:
    gain = answer.get("gain")
    if not gain:
        return (
            "The gain is not measured: too few runs to hold some out." if answer["causes"] else ""
        )
    share = gain.get("share_of_reachable")
    if not share:
        return "The refitted simulation leaves no gap to the noise that could be closed."
    percent = 100.0 * min(max(share["estimate"], 0.0), 1.0)
    count, noun = len(gain["final_runs"]), _noun(answer)
    ends = interval_of(share, count)
    interval = f" (95 % interval: {ends})" if ends else ""
    return (
        f"The extended model closes {percent:.0f} % of the gap between the refitted simulation and "
        f"the noise{interval}, on {count} held-out {noun}{'s' * (count != 1)}."
    )


def _noun(answer: Answer) -> str:
    return "condition" if answer.get("kind") == "steady" else "run"


def _doubtful(answer: Answer) -> bool:
    share = ((answer.get("gain") or {}).get("share_of_reachable") or {}).get("estimate")
    return bool(answer["causes"]) and share is not None and share < POLICY.least_share


def _next_step(answer: Answer) -> str:
    verdict, proposal = answer["verdict"], answer.get("next_experiment") or {}
    swim = ""
    if proposal.get("schedule"):
        aims = list(proposal.get("separates", ()))
        swim = (
            f"record a run of “{proposal.get('manoeuvre', 'the schedule')}” ({EXPERIMENT_FILE}), "
            "add it to the dataset and diagnose again"
        )
        if aims:
            seen = "it separates the explanations" if verdict == "ambiguous" else "it would show "
            more = len(aims) - MOST_NAMED
            seen += "" if verdict == "ambiguous" else ", ".join(aims[:MOST_NAMED])
            swim += f"; {seen}" + (f" and {more} more" if more > 0 and "show" in seen else "")
        swim += "."
    if verdict == "inputs":
        fixes = [f["fix"] for f in answer.get("inputs", ()) if f["decisive"] and f["fix"]]
        written = "; ".join(f"`{fix}`" for fix in fixes)
        if len(written) > LONGEST_FIX:
            written = "`fix` under `inputs` in diagnosis.json"
        if not written:
            return "check the sensors and the columns of the log, and measure again."
        return f"write {written} into dataset.yaml and diagnose again."
    if answer.get("quick") and verdict in ("outside_library", "partial"):
        return "diagnose again without --quick."
    if verdict == "ambiguous":
        return swim or "record more varied runs and diagnose again."
    if _doubtful(answer):
        return "do not use the extended model; record more runs and diagnose again."
    if verdict in ("cause", "parameters", "partial"):
        return "simulate and train with extended.yaml, a fish file with what was found."
    if verdict == "outside_library":
        return "read “Location of the misfit”, then add your own effect from a Python file."
    return swim or "use the refitted coefficients; nothing needs to be added."


def _caveats(answer: Answer) -> str:
    found = []
    if answer.get("quick"):
        found.append("quick mode: rival causes are not compared and weak causes may be missed")
    if _doubtful(answer):
        found.append("the named causes hardly improve held-out predictions")
    gain = answer.get("gain")
    if gain and gain["final_runs"] and not enough_runs(len(gain["final_runs"])):
        noun = _noun(answer)
        count = len(gain["final_runs"])
        held = f"one held-out {noun} gives" if count == 1 else f"{count} held-out {noun}s give"
        found.append(f"{held} no interval over {noun}s")
    blind = sum(not p["excited"] for p in answer.get("preconditions", ()))
    if blind:
        known = len(answer["preconditions"])
        found.append(f"these data could not show {blind} of {known} known effects")
    unsure = sum(not fault["decisive"] for fault in answer.get("inputs", ()))
    if unsure:
        found.append(
            f"{unsure} possible mistake{'s' * (unsure > 1)} in the data (see Input checks)"
        )
    if answer.get("doubts"):
        found.append("some numbers are implausible (see Notes)")
    return f"Caveats: {'; '.join(found)}." if found else ""
