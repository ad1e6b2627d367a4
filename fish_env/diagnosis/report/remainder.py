"""What the best explanation leaves: which wrenches the data ask for, and a model made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fish_env.diagnosis.answer import dependence
from fish_env.diagnosis.report.html import number, paragraph, table, text
from fish_env.identification.generic_forces import wrench_unit

Answer = Mapping[str, Any]


def asked_for(answer: Answer) -> str:
    """Single wrenches that the data still indicate."""
    rows = []
    for item in answer.get("unexplained", []):
        size = f"{number(item['rms'])} {wrench_unit(item['direction'])}"
        rows.append((text(item["direction"]), text(dependence(item)), size))
    caption = "Forces and moments that the data indicate beyond the best explanation"
    return table(("force or moment in", "depends on", "rms"), rows, caption)


def residual_model(answer: Answer) -> str:
    """The residual as a sum of wrenches, and whether it predicts other runs."""
    model = answer.get("residual_model")
    if not model:
        return ""
    rows = []
    for term in model["terms"]:
        low, high = term["ci95"]
        size = f"{number(term['coefficient'])} {term['unit']}"
        within = f"{number(low)} to {number(high)}"
        scale = number(term["function_rms"])
        rows.append((text(term["direction"]), text(term["depends_on"]), scale, size, within))
    caption = "Empirical model of the residual: the sum of coefficient × function / rms"
    heads = ("force or moment in", "function", "its rms (SI units)", "coefficient", "95 % interval")
    return table(heads, rows, caption) + paragraph(_pushes(model) + _elsewhere(model["gain"]))


def _pushes(model: Answer) -> str:
    """How far the disturbance shrinks."""
    sizes = [model["disturbance"][key] for key in ("without", "with")]
    forces = " to ".join(f"{number(1e3 * size['force_sd'])}" for size in sizes)
    moments = " to ".join(f"{number(1e3 * size['moment_sd'])}" for size in sizes)
    beside = f" (beside {', '.join(model['beside'])})" if model["beside"] else ""
    return (
        f"With it{beside}, the force of the disturbance changes from {forces} mN, and its moment "
        f"from {moments} mN m."
    )


def _elsewhere(gain: Answer | None) -> str:
    if not gain:
        return ""
    score, runs = gain["log_likelihood"], ", ".join(gain["final_runs"])
    low, high = score["ci95"]
    worse = "worsens" if high < 0.0 else "does not significantly improve"
    holds = "improves" if low > 0.0 else worse
    return (
        f" It {holds} the prediction of the held-out runs {runs}: one sample ahead, their log "
        f"likelihood changes by {score['estimate']:.0f} ({low:.0f} to {high:.0f})."
    )
