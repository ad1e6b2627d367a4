"""`robofish compare`: simulated against measured."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.progress import Progress
from rich.table import Table

from fish_env.commands.numbers import write_json
from fish_env.comparison import RunComparison, RunsComparison, SteadyComparison, compare
from fish_env.comparison.words import in_words, shown_unit
from fish_env.data import Dataset, SteadyDataset, dataset_files, load_dataset
from fish_env.errors import DatasetError
from fish_env.files import check_chosen, check_outputs
from fish_env.params import FishParams, fish_files, load_fish

Comparison = RunsComparison | SteadyComparison
Groups = Mapping[str, tuple[RunComparison, ...]]


def compare_dataset(
    console: Console,
    dataset: str,
    fish: str | None,
    json_file: Path | None,
    out: Path | None,
    dt: float,
    every_run: bool,
    replay: Path | None = None,
    trust_effects: bool = False,
) -> Comparison:
    """Compares a dataset with its simulation and writes what was asked for.

    Args:
        console: Where the tables go.
        dataset: Folder, or name of a shipped dataset.
        fish: Another fish than the dataset names: preset or file.
        json_file: File for all numbers.
        out: Folder for pictures.
        dt: Longest physics step, s.
        every_run: Print each run, not only conditions.
        replay: HTML page that shows measured and simulated fish swim.
        trust_effects: Run the effect files that the fish's file names.

    Raises:
        RoboticFishError: The data or the fish cannot be used; a replay of a steady table; or an
            output would replace a file of someone else.
    """
    measured = load_dataset(dataset)
    if replay is not None and isinstance(measured, SteadyDataset):
        raise DatasetError(f"{dataset}: a table of steady motion has no runs to replay")
    model = load_fish(fish or measured.fish, trust_effects)
    check_outputs([json_file, replay], [*dataset_files(dataset), *fish_files(model)])
    if out is not None:
        from fish_env.plotting.comparison import picture_files

        check_chosen(picture_files(measured, out))
    comparison = _compare(console, measured, model, dt)
    print_comparison(console, comparison, every_run)
    if json_file is not None:
        write_json(console, json_file, comparison.as_dict())
    if out is not None:
        draw(console, comparison, out)
    suggest_diagnosis(console, dataset)
    if replay is not None and isinstance(measured, Dataset):
        from fish_env.commands.replay import replay_comparison

        assert isinstance(comparison, RunsComparison)
        replay_comparison(console, measured, comparison, model, dt, replay)
    return comparison


def _compare(
    console: Console, measured: Dataset | SteadyDataset, fish: FishParams, dt: float
) -> Comparison:
    if isinstance(measured, SteadyDataset):
        with console.status("simulating until steady"):
            return compare(measured, fish, dt)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("simulating runs", total=len(measured.runs))
        return compare(measured, fish, dt, progress=lambda _: progress.advance(task))


def suggest_diagnosis(console: Console, dataset: str) -> None:
    """Names the command that finds the cause of what a comparison shows."""
    name = Path(dataset).resolve().name if Path(dataset).exists() else dataset
    console.print(
        f"next: to find what causes these errors: robofish diagnose {dataset} --out out/{name}",
        soft_wrap=True,
        highlight=False,
        markup=False,
    )


def draw(console: Console, comparison: Comparison, folder: Path) -> None:
    """Draws the pictures of a comparison and names them."""
    from fish_env.plotting.comparison import draw_runs, draw_steady

    with console.status("drawing"):
        if isinstance(comparison, SteadyComparison):
            written = draw_steady(comparison, folder)
        else:
            written = draw_runs(comparison, folder)
    shown = [str(path) for path in written if not path.name.startswith("run_")]
    single = len(written) - len(shown)
    console.print("pictures:", ", ".join(shown), soft_wrap=True)
    if single:
        console.print(f"and one of each run: {folder}/run_*.png ({single})", soft_wrap=True)


def print_comparison(console: Console, comparison: Comparison, every_run: bool = False) -> None:
    """Prints the findings in words, tables, and the notes of the dataset."""
    effects = ", ".join(comparison.effects) or "none"
    console.print(
        f"[bold]{escape(comparison.dataset)}[/bold] against fish "
        f"[bold]{escape(comparison.fish)}[/bold] (effects: {escape(effects)}); "
        "errors are simulated minus measured",
        highlight=False,
        soft_wrap=True,
    )
    for sentence in in_words(comparison):
        console.print(f"• {sentence}", highlight=False, markup=False)
    if isinstance(comparison, SteadyComparison):
        _print_steady(console, comparison)
    else:
        _print_runs(console, comparison, every_run)
    for note in comparison.notes:
        console.print(f"note: {note}", style="dim", highlight=False, markup=False)


def _table(title: str, *columns: str) -> Table:
    table = Table(
        title=title,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    return table


def _shown(value: float) -> str:
    return f"{value:.2f}" if abs(value) >= 1.0 else f"{value:.4f}"


def _print_steady(console: Console, comparison: SteadyComparison) -> None:
    columns = ("observation", "unit", "R²", "MAE", "bias", "gain", "% error", "repeat sd")
    table, left_out = _table("Steady motion", *columns), list[str]()
    for o in comparison.observations.values():
        unit, factor = shown_unit(o.name)
        table.add_row(
            o.name,
            unit,
            f"{o.r_squared:.3f}",
            _shown(factor * o.mae),
            _shown(factor * o.bias),
            f"{o.gain:.3f}",
            f"{o.percent_error:.1f}",
            _shown(factor * o.repeat_sd),
        )
        left_out += [
            f"{o.name}: {len(o.measured) - o.rows} rows not compared, {o.rows - o.percent_rows} "
            "near zero not in its percentage"
        ]
    console.print(table)
    console.print(Padding("\n".join(left_out), (0, 0, 1, 0)), style="dim", highlight=False)
    if comparison.unsteady:
        names = ", ".join(comparison.unsteady)
        console.print(f"not steady after the longest wait: {names}", markup=False)
    console.print(_worst_table(comparison))


def _worst_table(comparison: SteadyComparison) -> Table:
    table = _table(
        "Largest errors", "condition", "observation", "unit", "measured", "simulated", "error"
    )
    for name in comparison.observations:
        unit, factor = shown_unit(name)
        for condition, error, measured, simulated in comparison.worst(name):
            numbers = (factor * value for value in (measured, simulated, error))
            table.add_row(escape(condition), name, unit, *map(_shown, numbers))
        table.add_section()
    return table


def _print_runs(console: Console, comparison: RunsComparison, every_run: bool) -> None:
    groups = comparison.by_condition()
    console.print(_error_table("By condition (means over runs)", "condition", groups))
    if every_run:
        runs = {run.id: (run,) for run in comparison.runs}
        console.print(_error_table("By run", "run", runs))
    else:
        console.print("every run: --runs, or --json for all numbers", style="dim")
    starts = dict.fromkeys(run.start_from for run in comparison.runs)
    console.print(f"simulations start from: {'; or '.join(starts)}", highlight=False, markup=False)


def _error_table(title: str, first: str, groups: Groups) -> Table:
    columns = (first, "runs", "channel", "unit", "RMSE", "MAE", "bias", "fit %", "path max")
    table = _table(title, *columns)
    for name, runs in groups.items():
        for row, channel in enumerate(runs[0].errors):
            path = [float(np.nanmax(run.path_error_m)) for run in runs if run.path_error_m.size]
            heading = (escape(name), str(len(runs))) if row == 0 else ("", "")
            farthest = f"{max(path):.3f}" if path and row == 0 else ""
            table.add_row(*heading, *_errors(channel, runs), farthest)
        table.add_section()
    return table


def _errors(channel: str, runs: tuple[RunComparison, ...]) -> list[str]:
    unit, factor = shown_unit(channel)
    errors = [run.errors[channel] for run in runs]
    rmse, mae, bias = (
        factor * float(np.mean([getattr(error, measure) for error in errors]))
        for measure in ("rmse", "mae", "bias")
    )
    fits = [error.fit_percent for error in errors if np.isfinite(error.fit_percent)]
    fit = f"{np.mean(fits):.0f}" if fits else "-"
    return [channel, unit, *map(_shown, (rmse, mae, bias)), fit]
