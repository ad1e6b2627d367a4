"""Section of the report: what the channels show without a model of forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fish_env.diagnosis.report.figures import Album
from fish_env.diagnosis.report.html import folded, marked, number, section, table, text
from fish_env.diagnosis.report.series import ReportSeries, SteadySeries
from fish_env.diagnosis.report.units import shown_unit

Answer = Mapping[str, Any]


def input_checks(answer: Answer, series: ReportSeries | SteadySeries | None, album: Album) -> str:
    """What is wrong with the data or their description, and the line that puts it right."""
    faults = answer.get("inputs", ())
    if not faults:
        return ""
    sentences = "".join(f"<li>{marked(fault['words'])}</li>" for fault in faults)
    lines = [
        (
            text(fault["target"]), f"<code>{text(fault['fix'])}</code>",
            "certain" if fault["decisive"] else "possible",
        )
        for fault in faults if fault["fix"]
    ]  # fmt: skip
    written = table(("what", "write into dataset.yaml", "status"), lines)
    return section(
        "Input checks", f"<ul>{sentences}</ul>", folded("Lines to write", written), key="inputs"
    )


def measurements(answer: Answer, series: ReportSeries | SteadySeries | None, album: Album) -> str:
    """Whether the channels agree among themselves, and how noisy each of them is."""
    agreed = (answer.get("consistency") or {}).get("sentences", [])
    sentences = "".join(f"<li>{text(sentence)}</li>" for sentence in agreed)
    sentences += "".join(f"<li>{text(sentence)}</li>" for sentence in differing(answer))
    rows = [_floor(floor) for floor in answer.get("noise_floor", [])]
    heads = ("channel", "noise in the filter (sd)", "from differences (sd)", "95 % interval",
             "unit")  # fmt: skip
    return section(
        "Measurements",
        f"<ul>{sentences}</ul>" if sentences else "",
        folded("Noise of each channel", table(heads, rows)),
        folded("Run-to-run variation and sensor errors", _variation(answer)),
        key="measurements",
    )


def differing(answer: Answer) -> list[str]:
    """Run-to-run variation and sensor errors beyond the usual, and jitter of the sample times."""
    jitter_s = (answer.get("noise") or {}).get("disturbance", {}).get("jitter_sd", 0.0)
    found = [_beyond(entry) for entry in answer.get("run_variation", []) if entry["beyond_usual"]]
    if jitter_s > 0.0:
        found.append(
            f"Samples are {1e3 * jitter_s:.1f} ms early or late (one standard deviation), in "
            "all channels."
        )
    return found


def _beyond(entry: Answer) -> str:
    """One thing that differs, or is off, by more than is usual."""
    how = "is off by about" if entry["shared"] else "differs between runs by"
    return (
        f"{named(entry['name'])} {how} {number(entry['sd'])} {entry['unit']} (one standard "
        f"deviation), {entry['sd'] / entry['usual_sd']:.0f} times the usual."
    )


def named(variation: str) -> str:
    """What a run variation is called in a sentence."""
    words = variation.replace("_", " ")
    return words[0].upper() + words[1:]


def _variation(answer: Answer) -> str:
    rows = [
        (
            text(named(entry["name"])), number(entry["sd"]), number(entry["usual_sd"]),
            number(min(entry["values"])), number(max(entry["values"])),
            text("" if entry["unit"] == "1" else entry["unit"]),
        )
        for entry in answer.get("run_variation", [])
    ]  # fmt: skip
    heads = ("what", "standard deviation", "usual", "smallest", "largest", "unit")
    return table(heads, rows)


def _floor(floor: Answer) -> tuple[str, ...]:
    unit, factor = shown_unit(floor["channel"])
    white, used = floor["white"], floor.get("filter_sd")
    filtered = "–" if used is None else number(factor * used)
    if white is None:
        return text(floor["channel"]), filtered, "–", "too few samples", text(unit)
    low, high = (factor * end for end in white["ci95"])
    bound = "at most " if floor.get("upper_bound") else ""
    return (
        text(floor["channel"]),
        filtered,
        bound + number(factor * white["sd"]),
        f"{number(low)} to {number(high)}",
        text(unit),
    )
