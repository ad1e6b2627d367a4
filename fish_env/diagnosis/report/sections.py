"""Sections of the report, each from the answer and, where it draws, from the series."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fish_env.diagnosis.headline import EXPERIMENT_FILE, facts, headline, interval_of, many_fitted
from fish_env.diagnosis.report import figures as draw
from fish_env.diagnosis.report.figures import Album
from fish_env.diagnosis.report.html import (
    figure,
    folded,
    marked,
    number,
    paragraph,
    section,
    table,
    text,
)
from fish_env.diagnosis.report.opening import draw_budget, draw_paths
from fish_env.diagnosis.report.remainder import asked_for, residual_model
from fish_env.diagnosis.report.series import SETTLED_S, ReportSeries, RunSeries, SteadySeries
from fish_env.diagnosis.report.units import shown_unit
from fish_env.inference.hypotheses import short_name
from fish_env.plotting.comparison import COMMAND_UNITS
from fish_env.replay import Group, component

Answer = Mapping[str, Any]
Series = ReportSeries | SteadySeries | None
MOST_DRAWN = 2
"""Runs with a drawing of their own; the replay has them all."""
MOST_PATHS = 3
"""Runs in the first picture."""


def verdict(answer: Answer, series: Series, album: Album) -> str:
    """Heading: the verdict, the closed share of the gap, what to do next, and the caveats."""
    name, said = str(answer["verdict"]), headline(answer)
    return (
        f'<header class="rp-verdict rp-{text(name)}"><p class="rp-facts">{text(facts(answer))}</p>'
        f"<h1>{text(said.verdict)}</h1>{paragraph(said.closed, 'rp-words')}"
        f'<p class="rp-words"><b>Next:</b> {marked(said.next_step)}</p>'
        f"{paragraph(said.caveats, 'rp-note')}</header>"
    )


def overview(answer: Answer, series: Series, album: Album) -> str:
    """The first picture: measured, simulated as given, and by the best explanation."""
    if not isinstance(series, ReportSeries) or not series.runs:
        return ""
    runs = series.runs[:MOST_PATHS]
    models = "the extended model" if runs[0].extended else "the refitted simulation"
    caption = (
        f"Measured runs, the original simulation, and {models}. Both are simulated without "
        f"measurements over the whole run, from {SETTLED_S:g} s after its start."
    )
    return figure(draw_paths(runs, album), caption, "rp-fit")


def budget(answer: Answer, series: Series, album: Album) -> str:
    """The error budget as a bar."""
    found = answer.get("budget")
    if not found:
        return ""
    noun, count = _noun(answer), len(found["runs"])
    where = f"{count} {'held-out' if found['held_out'] else 'fitted'} {noun}{'s' * (count != 1)}"
    caption = f"Shares of the error of the original simulation, on {where}."
    picture = figure(draw_budget(found, album), caption, "rp-fit")
    return section("Error budget", picture, key="budget")


def cause_values(answer: Answer, series: Series, album: Album) -> str:
    """What was found, and its rivals, with intervals."""
    rows = []
    sets = [("accepted", answer.get("causes", []))]
    sets += [(f"rival {i}", rival) for i, rival in enumerate(answer.get("alternatives", []), 1)]
    for word, causes in sets:
        for cause in causes:
            name = text(short_name(cause["name"]))
            for key, p in cause["parameters"].items():
                low, high = p["ci95"]
                interval = f"{number(low)} to {number(high)}"
                shown = (text(key), number(p["estimate"]), interval, text(p["unit"]))
                rows.append((name, *shown, word))
    heads = ("cause", "parameter", "estimate", "95 % interval", "unit", "status")
    return section("Causes", table(heads, rows))


def swimming(answer: Answer, series: Series, album: Album) -> str:
    """The replay: measured, baseline and extended fish in three dimensions."""
    if not isinstance(series, ReportSeries) or not series.runs:
        return ""
    groups = [Group(_run_name(r.id, r.final), r.motions) for r in series.runs]
    notes = [f"{run.id}: {note}" for run in series.runs for note in run.notes]
    return section(
        "Replay",
        paragraph(
            "The measured fish and the models, simulated over the whole run from the state that "
            f"the filter estimates {SETTLED_S:g} s after the start. Small errors add up here. The "
            "predictions below restart every few seconds."
        ),
        component(groups, series.fish, "runs"),
        *(paragraph(note, "rp-note") for note in notes),
        key="replay",
    )


def _run_name(id: str, final: bool) -> str:
    return f"{id} (held out)" if final else id


def _drawn(answer: Answer, series: ReportSeries) -> tuple[RunSeries, ...]:
    return series.runs[: 1 if answer.get("quick") else MOST_DRAWN]


def channels(answer: Answer, series: Series, album: Album) -> str:
    """One-step misfit, and each channel over time."""
    parts = []
    if answer.get("misfit"):
        picture = draw.draw_misfit(answer, album)
        errors = "Errors" if _noun(answer) == "condition" else "One-step prediction errors"
        parts.append(figure(picture, f"{errors} in units of the noise."))
    if isinstance(series, ReportSeries):
        window = series.window_s
        for i, run in enumerate(_drawn(answer, series)):
            caption = (
                f"{_run_name(run.id, run.final)}: measured, and predicted over windows of "
                f"{window:g} s."
            )
            drawn = figure(draw.draw_run(run, window, album), caption)
            parts.append(drawn if i == 0 else folded(_run_name(run.id, run.final), drawn))
    return section("Errors by channel", *parts, key="channels")


def steady(answer: Answer, series: Series, album: Album) -> str:
    """A table of steady motion: predicted against measured, condition by condition."""
    if not isinstance(series, SteadySeries):
        return ""
    picture = figure(draw.draw_steady(series, album), "Predicted against measured steady motion.")
    return section(
        "Errors by condition",
        picture,
        folded("All conditions", _steady_table(series)),
        key="conditions",
    )


def _steady_table(series: SteadySeries) -> str:
    heads, columns = ["condition"], []
    for name, measured in series.measured.items():
        unit, factor = shown_unit(name)
        models = {"measured": measured, "baseline": series.baseline[name]}
        if series.extended:
            models["extended"] = series.extended[name]
        for word, values in models.items():
            heads.append(f"{name.replace('_', ' ')}, {word} ({unit})")
            columns.append(factor * values)
    kept = series.left_out if series.left_out.size else np.zeros(len(series.conditions), bool)
    rows = [
        (text(_run_name(name, bool(kept[i]))), *(_cell(column[i]) for column in columns))
        for i, name in enumerate(series.conditions)
    ]
    return table(heads, rows)


def _cell(value: float) -> str:
    return number(float(value)) if np.isfinite(value) else "–"


def gain(answer: Answer, series: Series, album: Album) -> str:
    """How much better the extended model predicts held-out runs."""
    found = answer.get("gain")
    if not found:
        return ""
    parts = [_gain_words(found, _noun(answer))]
    runs = _fit_by_run(found, series)
    if runs:
        caption = "Fit of each held-out run, mean over its channels."
        parts.append(figure(draw.draw_gain(runs, album), caption))
        rows = [(text(run), number(a), number(b), number(b - a)) for run, (a, b) in runs.items()]
        heads = ("held-out run", "baseline fit (%)", "extended fit (%)", "gain (%)")
        parts.append(table(heads, rows))
    parts.append(_errors(found))
    return section("Gain on held-out data", *parts, key="gain")


def _gain_words(found: Answer, noun: str) -> str:
    fit, share = found.get("fit_percent"), found.get("share_of_reachable")
    said = []
    if fit:
        said.append(
            f"On {_counted(len(found.get('final_runs', ())), noun)}, predictions "
            f"fit {fit['extended']:.0f} % with the extension and {fit['baseline']:.0f} % with the "
            "refitted baseline."
        )
    if share:
        ends = interval_of(share, len(found.get("final_runs", ())))
        interval = f" (95 %: {ends})" if ends else ""
        said.append(
            f"It closes {100 * share['estimate']:.0f} % of the gap between the refitted baseline "
            f"and the noise{interval}."
        )
    return paragraph(" ".join(said))


def _noun(answer: Answer) -> str:
    return "condition" if answer.get("kind") == "steady" else "run"


def _counted(count: int, noun: str) -> str:
    return f"the held-out {noun}" if count == 1 else f"{count} held-out {noun}s"


def _fit_by_run(found: Answer, series: Series) -> dict[str, tuple[float, float]]:
    """Final run -> fit percent before and after; from the answer, else from the series."""
    fits = {run: item["fit_percent"] for run, item in found.get("runs", {}).items()}
    if not fits and isinstance(series, ReportSeries):
        fits = {run.id: run.fit_percent for run in series.runs if run.final and run.extended}
    return {run: (pair["baseline"], pair["extended"]) for run, pair in fits.items()}


def _errors(found: Answer) -> str:
    rows = []
    for name, pair in found.get("rmse", {}).items():
        unit, factor = shown_unit(name)
        before, after = factor * pair["baseline"], factor * pair["extended"]
        rows.append((text(name), number(before), number(after), unit))
    heads = ("channel", "baseline RMSE", "extended RMSE", "unit")
    return folded("RMSE by channel", table(heads, rows))


def where(answer: Answer, series: Series, album: Album) -> str:
    """Regimes with most misfit, and regimes that no run visited."""
    parts = []
    found = series.localisation if isinstance(series, ReportSeries) else None
    if found is not None:
        parts.append(paragraph(found.words()))
        if not answer.get("quick"):
            parts.append(
                figure(
                    draw.draw_regimes(found, album),
                    "Error of the refitted baseline in each channel and regime. Framed cells: the "
                    "error is larger than chance would produce in any cell. Hatched cells: no run "
                    "visited them.",
                )
            )
        by_regime: dict[str, list[str]] = {}
        for regime, label in found.never_visited:
            by_regime.setdefault(regime.replace("_", " "), []).append(label)
        rows = [(text(regime), text(", ".join(bins))) for regime, bins in by_regime.items()]
        parts.append(table(("never visited", "bins"), rows))
    parts += [_farthest(answer), asked_for(answer), residual_model(answer)]
    return section("Location of the misfit", *parts, key="where")


def _farthest(answer: Answer) -> str:
    """Conditions of a table with the largest errors of the best explanation."""
    worst = (answer.get("floor") or {}).get("worst", [])
    rows = [
        (text(w["condition"]), text(w["observation"].replace("_", " ")), number(w["noise_sds"]))
        for w in worst
    ]
    caption = "Largest errors of the best explanation"
    return table(("condition", "observation", "error (noise sd)"), rows, caption)


def ranking(answer: Answer, series: Series, album: Album) -> str:
    """The refitted causes by how much each explains."""
    if not answer.get("ranking"):
        return ""
    caption = (
        "How much better each refitted cause predicts the data left out of the fit. "
        "Full bars: accepted. Hatched bars: rejected."
        + (" Lines: 95 % intervals over runs." if many_fitted(answer) else "")
    )
    return section("Ranking", figure(draw.draw_ranking(answer, album), caption), key="ranking")


def experiment(answer: Answer, series: Series, album: Album) -> str:
    """The next experiment as a schedule of commands."""
    proposal = answer.get("next_experiment") or {}
    schedule = proposal.get("schedule")
    if not schedule:
        return ""
    aim = "to separate" if answer["verdict"] == "ambiguous" else "to show"
    goal = f", {aim}: {', '.join(proposal['separates'])}" if proposal.get("separates") else ""
    units = {name: COMMAND_UNITS[name] for name in schedule[0] if name in COMMAND_UNITS}
    heads = ["from (s)", *(f"{n.replace('_', ' ')} ({unit})" for n, (unit, _) in units.items())]
    rows = [
        (number(row["t"]), *(number(factor * row.get(n, 0.0)) for n, (_, factor) in units.items()))
        for row in schedule
    ]
    name = str(proposal.get("manoeuvre", "the schedule below"))
    return section(
        "Next experiment",
        paragraph(
            f"Record a run of “{name}” from rest{goal}. {EXPERIMENT_FILE} has the commands in SI "
            "units (rad, Hz, m)."
        ),
        figure(draw.draw_schedule(schedule, album), f"Commands of “{name}”."),
        table(heads, rows, "Each row holds until the next"),
        key="next",
    )


def coefficients(answer: Answer, series: Series, album: Album) -> str:
    """Every coefficient: before, after, and the change in prior standard deviations."""
    rows = []
    found = answer.get("parameters", [])
    for p in sorted(found, key=lambda p: -abs(p.get("prior_sds_off", 0.0))):
        low, high = p["ci95"]
        moved = p.get("prior_sds_off")
        rows.append(
            (
                text(short_name(p["name"])), number(p["nominal"]),
                number(p["estimate"]), f"{number(low)} to {number(high)}", text(p.get("unit", "")),
                "–" if moved is None else f"{moved:+.1f}",
                number(p["smallest_detectable"]) if p.get("smallest_detectable") else "–",
            )
        )  # fmt: skip
    heads = (
        "coefficient",
        "before",
        "found",
        "95 % interval",
        "unit",
        "change (prior sd)",
        "smallest detectable change",
    )
    return section(
        "Coefficients",
        folded(f"All {len(rows)}, largest change first", table(heads, rows)) if rows else "",
    )


def about(answer: Answer, series: Series, album: Album) -> str:
    """Noise, notes, and how this was made."""
    lines = [str(note) for note in answer.get("notes", [])]
    lines += [str(doubt) for doubt in answer.get("doubts", ())]
    if answer.get("quick"):
        lines.append(f"Quick mode leaves out: {'; '.join(answer.get('left_out', []))}.")
    d = (answer.get("noise") or {}).get("disturbance", {})
    if "force_sd" in d:
        lines.append(
            f"Disturbance found: {1e3 * d['force_sd']:.3g} mN and {1e3 * d['moment_sd']:.3g} mN m, "
            f"correlated over {d['correlation_s']:.2g} s."
        )
    lines.append(
        f"Seed {answer.get('seed', '?')}; {answer.get('runtime_s', 0.0):.0f} s. Numbers: "
        "diagnosis.json; figures as files: folder figures."
    )
    return section("Notes", *(paragraph(line) for line in lines))
