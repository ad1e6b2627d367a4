"""Section of the report: what the channels say before any model of forces is asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fish_env.diagnosis.report.figures import Album
from fish_env.diagnosis.report.html import folded, number, section, table, text
from fish_env.diagnosis.report.series import ReportSeries, SteadySeries
from fish_env.diagnosis.report.units import shown_unit

Answer = Mapping[str, Any]


def measurements(answer: Answer, series: ReportSeries | SteadySeries | None, album: Album) -> str:
    """Whether the channels agree among themselves, and how noisy each of them is."""
    agreed = (answer.get("consistency") or {}).get("sentences", [])
    sentences = "".join(f"<li>{text(sentence)}</li>" for sentence in agreed)
    rows = [_floor(floor) for floor in answer.get("noise_floor", [])]
    heads = ("channel", "white noise (sd)", "95 % interval", "unit")
    return section(
        "The measurements themselves",
        f"<ul>{sentences}</ul>" if sentences else "",
        folded("Noise of each channel, from the data alone", table(heads, rows)),
        key="measurements",
    )


def _floor(floor: Answer) -> tuple[str, ...]:
    unit, factor = shown_unit(floor["channel"])
    white = floor["white"]
    if white is None:
        return text(floor["channel"]), "–", "too few samples", text(unit)
    low, high = (factor * end for end in white["ci95"])
    bound = "at most " if floor.get("upper_bound") else ""
    return (
        text(floor["channel"]),
        bound + number(factor * white["sd"]),
        f"{number(low)} to {number(high)}",
        text(unit),
    )
