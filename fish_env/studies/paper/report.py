"""The study written down: statements as a table, and every number as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fish_env.comparison.errors import plain
from fish_env.files import check_chosen, write_text
from fish_env.studies.paper import ranges
from fish_env.studies.paper.motions import Study
from fish_env.studies.paper.statements import (
    NOT_CHECKABLE,
    Statement,
    all_statements,
    with_servo_lag,
)
from fish_env.version import versioned

TITLE = "# The paper's statements and this model"
COLUMNS = ("motion", "statement", "criterion", "this model", "verdict")


def statements_markdown(study: Study) -> str:
    """Every statement with its criterion, its numbers and its verdict."""
    statements, lagged = all_statements(study), with_servo_lag(study)
    held = sum(s.held for s in statements)
    return "\n".join(
        [
            TITLE,
            "",
            "Written by `robofish paper`. "
            f"The model without effects reproduces {held} of {len(statements)} statements. "
            "No parameter was tuned to make a statement hold.",
            "",
            "Means and amplitudes are over whole tail beats after the transient. An amplitude is "
            "half the range. U_r, U_g, U_s are speeds along the path without the swaying of each "
            "beat, w_t and w_s mean yaw rates, R_t = U_t / w_t. Rates are those of the body frame.",
            "",
            *_table(statements),
            "",
            "## With a servo that lags",
            "",
            _lag_words(study),
            "",
            *_table(lagged),
            "",
            "## Numbers that need the measured values",
            "",
            "The paper prints these errors of its own simulation against its measurements. The "
            "measured values appear only in its figures, so they are not checked here:",
            "",
            *(f"* {item}" for item in NOT_CHECKABLE),
            "",
            "## Ranges chosen here",
            "",
            "The paper's axes and supplement are not available for these:",
            "",
            *(f"* {item}" for item in ranges.CHOSEN),
            "",
            "Some displacements lie beyond the reach of the reconstructed crank (about -1.2 cm); "
            "they are simulated as the paper states them.",
            "",
        ]
    )


def _lag_words(study: Study) -> str:
    lag, tried = max(study.lagged), ", ".join(f"{value:g}" for value in study.lagged)
    return (
        "The paper's rate amplitudes fall with frequency. With an ideal servo this model cannot "
        "show that: its yaw amplitude is nearly constant in frequency, so the rate grows. The "
        "effect `servo_lag` reduces the amplitude at higher frequencies. Of the time constants "
        f"{tried} s the longest, {lag:g} s, is shown. It makes all three amplitudes fall, but then "
        "the turning rate no longer grows with f1: a first-order lag alone does not give both."
    )


def _table(statements: Iterable[Statement]) -> list[str]:
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + " --- |" * len(COLUMNS)]
    for s in statements:
        verdict = f"**{s.verdict}**" if not s.held else s.verdict
        verdict += f": {s.remark}" if s.remark else ""
        cells = (s.motion, s.statement, s.criterion, s.measured, verdict)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def study_json(study: Study) -> dict[str, Any]:
    """Every number of the study, SI units unless a name says otherwise; no time series."""
    return {
        "fish": {"rectilinear and turning": ranges.FISH_A, "gliding and spiral": ranges.FISH_B},
        "ranges_chosen_here": list(ranges.CHOSEN),
        "statements": [_statement(s) for s in all_statements(study)],
        "statements_with_servo_lag": [_statement(s) for s in with_servo_lag(study)],
        "needs_measured_values": list(NOT_CHECKABLE),
        "rectilinear": plain(study.straight),
        "turning": plain(study.turning),
        "turning_negative_offset": plain(study.turning_left),
        "turning_with_servo_lag": {str(lag): plain(data) for lag, data in study.lagged.items()},
        "gliding": plain(study.gliding),
        "gliding_accelerating": plain(study.accelerating),
        "spiral": plain(study.spiral),
    }


def _statement(statement: Statement) -> dict[str, Any]:
    return {**plain(statement), "verdict": statement.verdict}


def check_reports(folder: Path) -> tuple[Path, Path]:
    """Names what `write_report` will write, and refuses files of someone else with these names.

    Raises:
        OutputError: Names the file.
    """
    words, numbers = folder / "statements.md", folder / "paper.json"
    check_chosen([words], TITLE)
    check_chosen([numbers], '"version": ')
    return words, numbers


def write_report(study: Study, folder: Path) -> list[Path]:
    """Writes `statements.md` and `paper.json`; returns their paths."""
    words, numbers = check_reports(folder)
    write_text(words, statements_markdown(study))
    write_text(numbers, json.dumps(versioned(study_json(study)), indent=1, allow_nan=False) + "\n")
    return [words, numbers]
