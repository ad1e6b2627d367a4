"""The report: sections from the answer, drawings and the replay, put into one file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fish_env.diagnosis.report import sections
from fish_env.diagnosis.report.blind import unseen
from fish_env.diagnosis.report.figures import Album
from fish_env.diagnosis.report.flight import write_schedule
from fish_env.diagnosis.report.html import text
from fish_env.diagnosis.report.measurements import input_checks, measurements
from fish_env.diagnosis.report.series import ReportSeries, SteadySeries
from fish_env.diagnosis.written import replace_part
from fish_env.files import write_text
from fish_env.replay import component_scripts, component_style
from fish_env.version import generator

Answer = Mapping[str, Any]
Series = ReportSeries | SteadySeries | None
Part = Callable[[Answer, Series, Album], str]
STYLE = Path(__file__).with_name("report.css")
PARTS: tuple[Part, ...] = (
    sections.verdict,
    sections.overview,
    sections.budget,
    input_checks,
    sections.cause_values,
    sections.swimming,
    sections.channels,
    sections.steady,
    sections.gain,
    sections.where,
    sections.ranking,
    unseen,
    sections.experiment,
    measurements,
    sections.coefficients,
    sections.about,
)
"""In the order of the page; a part that has nothing to say is empty."""


def write_report(answer: Answer, series: Series, out: str | Path) -> Path:
    """Writes ``report.html``, its figures and the next experiment's schedule into a folder.

    Figures are SVG and PNG; quick mode has no PNG and no map of where the misfit sits. Those of
    an earlier diagnosis that this one lacks are removed; other files in the folder stay.

    Args:
        answer: Content of ``diagnosis.json``; what it lacks is left out of the page.
        series: What to draw of the runs, or of a table of steady motion; None: only the answer.
        out: The folder; figures go to its folder ``figures``.

    Returns:
        The path of the page.
    """
    folder = Path(out)
    album = Album(folder / "figures", bitmaps=not answer.get("quick"))
    body = "\n".join(filter(None, (part(answer, series, album) for part in PARTS)))
    page = folder / "report.html"
    write_text(page, _page(answer, body))
    # Figures and schedules of an earlier diagnosis would contradict this one.
    replace_part(folder, "figures", album.written)
    replace_part(folder, "next experiment", write_schedule(answer, folder))
    return page


def _page(answer: Answer, body: str) -> str:
    title = text(f"Diagnosis of {answer.get('dataset', 'measured runs')}")
    scripts = component_scripts() if "rf-replay" in body else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="color-scheme" content="light dark">\n{generator()}\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{title}</title>\n{component_style()}\n"
        f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n"
        f'<body class="rf-page rp-page">\n<main>\n{body}\n</main>\n{scripts}\n</body>\n</html>\n'
    )
