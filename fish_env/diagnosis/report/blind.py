"""Section of the report: what the data could not have shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fish_env.diagnosis.report import figures as draw
from fish_env.diagnosis.report.figures import Album
from fish_env.diagnosis.report.html import figure, number, paragraph, section, table, text
from fish_env.diagnosis.report.series import ReportSeries, SteadySeries
from fish_env.effects import catalogue

Answer = Mapping[str, Any]
MOST_NAMED = 8
"""Names in one sentence."""


def unseen(answer: Answer, series: ReportSeries | SteadySeries | None, album: Album) -> str:
    """What these runs could have shown of each effect, and what they confuse it with."""
    found = answer.get("preconditions", [])
    if not found:
        return ""
    blind = [p["name"] for p in found if not p["excited"]]
    said = _blind_words(blind, len(found), "This table" if answer.get("kind") else "These runs")
    heads = (
        "effect", "detectable", "smallest detectable size (power 0.8)", "plausible size",
        "absorbed by a refit", "most similar effect",
    )  # fmt: skip
    order = sorted(found, key=lambda p: (p["excited"], p["name"]))
    parts = [paragraph(said), table(heads, [_seen(p) for p in order])]
    if all(p.get("confusability") for p in found):
        names = [p["name"] for p in found]
        cosines = np.array([[_cosine(p, name) for name in names] for p in found])
        caption = "Cosine between the signals of two effects, after a refit of the baseline."
        parts.append(figure(draw.draw_confusability(names, cosines, album), caption))
    return section("Detectability", *parts, key="unseen")


def _blind_words(blind: list[str], known: int, subject: str) -> str:
    if not blind:
        return "Every known effect would have been detected at a plausible size."
    if len(blind) > MOST_NAMED:
        return f"{subject} could not have shown {len(blind)} of {known} known effects, see below."
    return f"{subject} could not have shown: {', '.join(blind)}."


def _cosine(precondition: Answer, other: str) -> float:
    own = precondition["name"] == other
    return 1.0 if own else float(precondition["confusability"].get(other, 0.0))


def _seen(p: Answer) -> tuple[str, ...]:
    sizes, plausible = [], []
    known = _known_parameters(p["name"])
    for name, size in p["smallest_detectable"].items():
        unit, around, upto = "", "", ""
        if name in known:
            parameter = known[name]
            unit = "" if parameter.unit == "-" else f" {parameter.unit.replace('^2', '²')}"
            neutral = parameter.neutral
            around = f" from {neutral:g}" if np.isfinite(neutral) and neutral else ""
            upto = "up to " if np.isposinf(neutral) else ""
            low, high = parameter.plausible
            plausible.append(text(f"{low:g} to {high:g}{unit}"))
        sizes.append(text(f"{name} {upto}{number(size)}{unit}{around}"))
    near = p.get("most_confusable")
    return (
        text(p["name"]),
        "yes" if p["excited"] else '<strong class="rp-no">no</strong>',
        "<br>".join(sizes) or "–",
        "<br>".join(plausible) or "–",
        f"{100 * p['absorbed_share']:.0f} %",
        text(f"{near[0]} ({near[1]:.2f})") if near else "–",
    )


def _known_parameters(name: str) -> dict[str, Any]:
    effect = catalogue().get(name)
    return {p.name: p for p in effect.parameters} if effect else {}
