"""`robofish diagnose`: what the simulation of a fish gets wrong."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from fish_env.commands.numbers import write_json
from fish_env.data import dataset_files
from fish_env.diagnosis.answer import dependence, holds_elsewhere
from fish_env.diagnosis.headline import facts, headline
from fish_env.diagnosis.pipeline import diagnose
from fish_env.diagnosis.writing import EXTENDED
from fish_env.errors import Interrupted
from fish_env.files import check_outputs
from fish_env.identification.generic_forces import wrench_unit
from fish_env.inference.verdict import EXTENDING

COLLECT_AFTER = 100_000
"""New objects after which garbage is looked for; Python 3.11 does so after 700."""


def diagnose_dataset(
    console: Console,
    dataset: str,
    out: Path,
    fish: str | None,
    quick: bool,
    seed: int,
    measured_beats: bool = False,
    trust_effects: bool = False,
    json_file: Path | None = None,
    patient: bool = False,
) -> dict[str, Any]:
    """Diagnoses a dataset, prints the verdict and writes the files.

    Args:
        console: Where the verdict goes.
        dataset: Folder, or name of a shipped dataset.
        out: Folder for `diagnosis.json`, `report.html` and `extended.yaml`.
        fish: Another fish than the dataset names: preset or file.
        quick: Fit the first 20 s of two runs only.
        seed: Of the split into runs and of the null distributions.
        measured_beats: Take the tail's frequencies from the hull's swaying.
        trust_effects: Run the effect files that the fish's file names.
        json_file: File for the content of `diagnosis.json` once more.
        patient: Search without a limit on how often the runs are simulated.

    Raises:
        RoboticFishError: The data or the fish cannot be used.
    """
    check_outputs([json_file], dataset_files(dataset))
    # What is loaded by now stays, and hardly anything made later refers to itself: to look for
    # garbage as often as usual would take a fifteenth of quick mode's time.
    gc.freeze()
    gc.set_threshold(COLLECT_AFTER)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("reading", total=None)

        def tell(step: str) -> None:
            progress.update(task, description=step)

        try:
            answer = diagnose(
                dataset, out, seed, quick, fish, tell, measured_beats, trust_effects, patient
            )
        except KeyboardInterrupt:
            raise Interrupted(
                f"stopped; nothing was written, {out} is as it was. Start again; --quick takes "
                "seconds"
            ) from None
    print_answer(console, answer)
    _print_files(console, out, answer["verdict"] in EXTENDING)
    if json_file is not None:
        write_json(console, json_file, answer)
    return answer


def _print_files(console: Console, out: Path, extends: bool) -> None:
    files = {"report": "report.html", "numbers": "diagnosis.json", "extended model": EXTENDED}
    for word, name in files.items():
        if not (out / name).exists():
            continue
        if name == EXTENDED and not extends:
            word = "not of this diagnosis, left as it was"
        console.print(f"{word}: {out / name}", soft_wrap=True)


def print_answer(console: Console, answer: dict[str, Any]) -> None:
    """Prints the headline of the report, then what supports it."""
    print_headline(console, answer)
    for fault in answer.get("inputs", ()):
        if not (fault["decisive"] and answer["verdict"] == "inputs"):  # in the headline
            word = "inputs" if fault["decisive"] else "perhaps"
            console.print(f"{word}: {escape(fault['words'])}", highlight=False)
    if answer["causes"]:
        console.print(_causes(answer))
    console.print(_misfit(answer))
    if holds_elsewhere(answer):
        console.print(_residual_model(answer["residual_model"]))
    elif answer["unexplained"]:
        console.print(_unexplained(answer))
    for doubt in answer.get("doubts", ()):
        console.print(f"implausible: {escape(doubt)}", highlight=False)
    for note in answer["notes"]:
        console.print(f"note: {note}", style="dim", highlight=False, markup=False)


def print_headline(console: Console, answer: dict[str, Any]) -> None:
    """Prints verdict, closed share of the gap, next step and caveats, as the report does."""
    said = headline(answer)
    console.print(facts(answer), style="dim", highlight=False, markup=False)
    console.print(said.verdict, style="bold", highlight=False, markup=False)
    for line in said.lines[1:]:
        style = "dim" if line == said.caveats else None
        console.print(line, style=style, highlight=False, markup=False)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right")
    return table


def _causes(answer: dict[str, Any]) -> Table:
    table = _table("Causes", "cause", "parameter", "estimate", "95 % interval", "unit")
    for explanation in (answer["causes"], *answer["alternatives"]):
        for cause in explanation:
            for name, p in cause["parameters"].items():
                low, high = p["ci95"]
                interval = f"{low:.4g} to {high:.4g}"
                table.add_row(cause["name"], name, f"{p['estimate']:.4g}", interval, p["unit"])
        table.add_section()
    return table


def _misfit(answer: dict[str, Any]) -> Table:
    steady = answer.get("kind") == "steady"
    errors = "Errors of averages" if steady else "One-step prediction errors"
    title = f"{errors} in units of the noise (1: only noise left)"
    table = _table(title, "channel", "refitted baseline", "with the causes")
    for name, pair in answer["misfit"].items():
        table.add_row(name, f"{pair['baseline']:.2f}", f"{pair['extended']:.2f}")
    return table


def _residual_model(model: dict[str, Any]) -> Table:
    title = "Model of the residual: simple functions at their root mean square"
    table = _table(title, "direction", "depends on", "coefficient", "95 % interval", "unit")
    for term in model["terms"]:
        low, high = term["ci95"]
        interval = f"{low:.3g} to {high:.3g}"
        size = f"{term['coefficient']:.3g}"
        table.add_row(term["direction"], term["depends_on"], size, interval, term["unit"])
    return table


def _unexplained(answer: dict[str, Any]) -> Table:
    table = _table("Forces indicated beyond every known cause", "direction", "depends on", "rms")
    for item in answer["unexplained"][:5]:
        size = f"{item['rms']:.2g} {wrench_unit(item['direction'])}"
        table.add_row(item["direction"], dependence(item), size)
    return table
