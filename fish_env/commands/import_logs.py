"""`robofish import`: anybody's logs made into a dataset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fish_env.data.description import FILE_NAME
from fish_env.data.importing import (
    MAPPING,
    Guess,
    Imported,
    Plan,
    Source,
    assemble,
    guess_mapping,
    open_logs,
    parse_plan,
    plan_text,
    read_content,
    write_imported,
    write_mapping,
)
from fish_env.data.importing.correction import corrected
from fish_env.data.importing.grouping import matches, safe_id
from fish_env.data.importing.guess import UNKNOWN_START
from fish_env.data.importing.plan import Content, Entry, fish_path
from fish_env.data.importing.writing import used_content
from fish_env.data.place import Place
from fish_env.data.writing import check_free
from fish_env.errors import DatasetError
from fish_env.files import check_chosen, check_outputs, same_file

Ask = Callable[[str], str]

QUESTION = "Write the dataset? yes, no, or a correction such as  yaw: {unit: deg, sign: -1} "
INCOMPLETE = (
    "What is missing, such as  fish: zheng-2021-a  or  tail_offset: {column: servo, unit: deg}, or "
    "no to stop: "
)
FRAMES = (
    "ned (x north, y east, z down; body forward, starboard, down) or enu (z up, body y to port)"
)


@dataclass(frozen=True)
class Told:
    """What the options tell about the logs; None where they do not.

    Attributes:
        fish: Preset or file.
        frame: "ned" or "enu".
        name: Name of the dataset.
        run_column: Column that tells runs apart.
        start: "rest" or "unknown", for all runs.
    """

    fish: str | None = None
    frame: str | None = None
    name: str | None = None
    run_column: str | None = None
    start: str | None = None

    def applied(self, content: Content) -> Content:
        """The mapping with what is told in place of what stands there."""
        fish = None if self.fish is None else fish_path(self.fish, Place(Path("--fish")))
        told = {
            "fish": fish,
            "frame": self.frame,
            "name": self.name,
            "run_column": self.run_column,
            "start": self.start,
        }
        return {**content, **{key: value for key, value in told.items() if value is not None}}


def import_logs(
    console: Console,
    logs: Sequence[str],
    out: Path,
    mapping: Path | None,
    told: Told,
    yes: bool,
    ask: Ask | None,
    json_file: Path | None = None,
) -> Imported | None:
    """Reads logs, shows what their columns are taken for, and writes a dataset once confirmed.

    Args:
        console: Where everything is shown.
        logs: Files, folders and patterns.
        out: Folder of the dataset.
        mapping: A mapping to use instead of guessing.
        told: What the options say.
        yes: Write without asking.
        ask: Asks a person one question; None where nobody can answer.
        json_file: Will be written afterwards, so it must be none of the logs.

    Returns:
        The dataset; None if the answer was no.

    Raises:
        RoboticFishError: The logs cannot be read, or are not what the mapping says.
    """
    check_free(out, [FILE_NAME])
    if mapping is None or not same_file(mapping, out / MAPPING):
        _check_mapping(out)
    sources, notes = open_logs(logs)
    read = dict.fromkeys(source.file for source in sources)
    check_outputs([json_file, out / FILE_NAME], [*read, mapping])
    for note in notes:
        console.print(f"note: {note}", style="dim", highlight=False, markup=False)
    if mapping is not None:
        content = told.applied(read_content(mapping))
        plan, imported = _build(content, sources, out, mapping)
        _show(console, plan, imported, sources, None)
        _draw(console, imported, out)
        return _write(console, plan, imported, out)
    name = told.name or safe_id(out.resolve().name)
    guess = guess_mapping(sources, name, told.applied({}).get("fish"), told.frame)
    if told.start is not None:
        assumed = tuple(words for words in guess.assumptions if words != UNKNOWN_START)
        guess = replace(guess, assumptions=assumed)
    if ask is not None and not yes:
        return _converse(console, guess, told.applied(guess.content), sources, out, ask)
    content = told.applied(guess.content)
    try:
        plan, imported = _build(content, sources, out)
    except DatasetError as error:
        raise _incomplete(console, error, guess, content, out) from None
    _show(console, plan, imported, sources, guess)
    _draw(console, imported, out)
    if not yes:
        raise DatasetError(
            f"{out}: no dataset was written, because the mapping above is a guess and there is no "
            "terminal to confirm it. Give --yes to accept it, or --mapping with your own mapping."
        )
    return _write(console, plan, imported, out)


def _check_mapping(out: Path) -> None:
    if (out / MAPPING).exists():
        raise DatasetError(
            f"{out / MAPPING}: this mapping already exists. Use it with --mapping {out / MAPPING}, "
            "or give --out another folder."
        )


def _build(
    content: Content, sources: Sequence[Source], out: Path, file: Path | None = None
) -> tuple[Plan, Imported]:
    for key, remedy in (("fish", "a fish's name or file"), ("frame", FRAMES)):
        if key not in content:
            raise DatasetError(
                f"the logs do not name the {key}: give --{key} {remedy}, or write `{key}:` in the "
                "mapping."
            )
    plan = parse_plan(content, file or out / MAPPING)
    return plan, assemble(plan, sources, out)


def _incomplete(
    console: Console, error: DatasetError, guess: Guess, content: Content, out: Path
) -> DatasetError:
    """What to raise when a guessed mapping cannot be used: it is kept, to be completed."""
    _show_guess(console, guess)
    file = write_mapping(content, out)
    return DatasetError(
        f"{str(error).rstrip('.')}. What was guessed is in {file}: complete it, then give "
        f"--mapping {file}."
    )


def _converse(
    console: Console,
    guess: Guess,
    content: Content,
    sources: Sequence[Source],
    out: Path,
    ask: Ask,
) -> Imported | None:
    """Shows the mapping, takes corrections until it is confirmed, and writes."""
    shown: Guess | None = guess
    columns = {column for source in sources for column in source.columns}
    while True:
        built = None
        try:
            built = _build(content, sources, out)
        except DatasetError as error:
            if shown is not None:
                _show_guess(console, shown)
            console.print(f"not yet complete: {error}", style="yellow", markup=False)
        else:
            _show(console, *built, sources, shown)
            _draw(console, built[1], out)
        shown = None
        while True:
            answer = _answer(ask, INCOMPLETE if built is None else QUESTION)
            if answer.lower() in ("n", "no", "q", "quit"):
                console.print("no dataset is written")
                return None
            if answer.lower() in ("y", "yes"):
                if built is not None:
                    return _write(console, *built, out)
                console.print("the mapping is not complete: correct it, or answer no")
                continue
            try:
                content = corrected(content, answer, columns)
                break
            except DatasetError as error:
                console.print(str(error), style="yellow", markup=False)


def _answer(ask: Ask, question: str) -> str:
    try:
        return ask(question).strip()
    except EOFError:
        return "no"


def _show_guess(console: Console, guess: Guess) -> None:
    console.print("[bold]Assumed[/bold]")
    for words in guess.assumptions:
        console.print(f"  • {words}", highlight=False, markup=False)
    for words in guess.left_out:
        console.print(f"  {words}", style="dim", highlight=False, markup=False)


def _show(
    console: Console,
    plan: Plan,
    imported: Imported,
    sources: Sequence[Source],
    guess: Guess | None,
) -> None:
    if guess is not None:
        _show_guess(console, guess)
    content = plan.content
    console.print(
        f"[bold]{escape(str(content['name']))}[/bold]: fish {escape(str(content['fish']))}, "
        f"frame {content['frame']}",
        highlight=False,
    )
    console.print(_mapping_table(plan, sources))
    console.print(_runs_table(imported))
    for note in (*imported.notes, *imported.dataset.notes):
        console.print(f"note: {note}", style="dim", highlight=False, markup=False)


def _mapping_table(plan: Plan, sources: Sequence[Source]) -> Table:
    table = Table(title="Mapping", title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("quantity", "column", "unit", "lowest", "highest"):
        right = heading.endswith("est")
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    for group in (plan.channels, plan.commands):
        for name, entry in group.items():
            table.add_row(name, *map(escape, _mapping_row(plan, entry, sources)))
        table.add_section()
    for name, value in plan.content.get("constant_commands", {}).items():
        table.add_row(name, "constant", "SI", str(value), str(value))
    return table


def _mapping_row(plan: Plan, entry: Entry, sources: Sequence[Source]) -> list[str]:
    """Column with all that is done to it, unit, and range as in the log."""
    spec, column = plan.sources[entry.source], entry.column
    values = np.concatenate([s.numbers(column.name) for s in sources if matches(spec, s)])
    words = column.name if len(plan.sources) == 1 else f"{entry.source}: {column.name}"
    words += f" times {column.factor:g}" if column.factor != 1.0 else ""
    words += f" plus {column.offset:g} {entry.unit.name}" if column.offset != 0.0 else ""
    words += f", frame {column.frame}" if column.frame != plan.content["frame"] else ""
    words += f", {entry.between}" if entry.between != "hold" else ""
    lowest, highest = np.nanmin(values), np.nanmax(values)
    return [words, entry.unit.name, f"{lowest:.4g}", f"{highest:.4g}"]


def in_numbers(imported: Imported, out: Path) -> dict[str, Any]:
    """What was imported, for `--json`: the content of dataset.yaml, the runs and the notes.

    Args:
        imported: The dataset.
        out: Its folder.
    """
    return {
        "folder": str(out),
        "description": dict(imported.description),
        "runs": [
            {
                "id": run.id,
                "duration_s": run.time_s[-1] - run.time_s[0],
                "rows": len(run.time_s),
                "command_changes": len(run.commands.times_s) - 1,
            }
            for run in imported.dataset.runs
        ],
        "notes": [*imported.notes, *imported.dataset.notes],
    }


def _runs_table(imported: Imported) -> Table:
    table = Table(title="Runs", title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("run", "duration, s", "rows", "command changes"):
        table.add_column(heading, justify="left" if heading == "run" else "right")
    for run in imported.dataset.runs:
        duration = run.time_s[-1] - run.time_s[0]
        changes = len(run.commands.times_s) - 1
        table.add_row(escape(run.id), f"{duration:.3f}", str(len(run.time_s)), str(changes))
    return table


def _draw(console: Console, imported: Imported, out: Path) -> None:
    from fish_env.plotting.imported import draw_imported, picture_files

    check_chosen(picture_files(imported.dataset, out))
    with console.status("drawing"):
        pictures = draw_imported(imported.dataset, out)
    shown = str(pictures[0]) if len(pictures) == 1 else f"{out}/import-*.png ({len(pictures)})"
    console.print(f"look at every channel and command: {shown}", soft_wrap=True)


def _write(console: Console, plan: Plan, imported: Imported, out: Path) -> Imported:
    written = write_imported(imported, plan, out)
    console.print(plan_text(used_content(plan)), highlight=False, markup=False, soft_wrap=True)
    console.print(
        f"written: {out}: {', '.join(path.name for path in written)}", soft_wrap=True, markup=False
    )
    console.print(f"next: robofish compare {out}", soft_wrap=True, markup=False)
    return imported
