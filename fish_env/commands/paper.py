"""`robofish paper`: the paper's four studies with this model."""

from __future__ import annotations

import time
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from fish_env.commands.numbers import write_json
from fish_env.files import check_chosen, check_outputs
from fish_env.studies.paper import Statement, all_statements, run_study, with_servo_lag
from fish_env.studies.paper.report import check_reports, study_json, write_report


def run_paper(console: Console, out: Path, json_file: Path | None = None) -> None:
    """Runs the study, prints the statements and writes tables and pictures into a folder.

    Args:
        console: Where the statements go.
        out: The folder.
        json_file: File for the content of `paper.json` once more.

    Raises:
        OutputError: An output cannot be written, or would replace another or a file of someone
            else.
    """
    from fish_env.studies.paper.figures import draw_study, picture_files

    check_outputs([json_file, *check_reports(out)])
    check_chosen(picture_files(out))
    begun = time.monotonic()
    with console.status("starting") as status:
        study = run_study(lambda part: status.update(f"simulating: {part}"))
        status.update("writing")
        written = write_report(study, out)
        status.update("drawing")
        pictures = draw_study(study, out)
    statements = all_statements(study)
    console.print(_table("The paper's statements", statements))
    console.print(_table("Turning with a lagging servo", with_servo_lag(study)))
    held = sum(s.held for s in statements)
    console.print(f"the model without effects reproduces {held} of {len(statements)} statements")
    console.print(f"written: {', '.join(str(path) for path in written)}", soft_wrap=True)
    console.print(f"pictures: {len(pictures)} in {out} (png and pdf)", soft_wrap=True)
    if json_file is not None:
        write_json(console, json_file, study_json(study))
    console.print(f"{time.monotonic() - begun:.0f} s", style="dim")


def _table(title: str, statements: list[Statement]) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("motion")
    table.add_column("statement", ratio=3)
    table.add_column("this model", ratio=3)
    table.add_column("verdict")
    for s in statements:
        verdict = "[green]held[/green]" if s.held else f"[yellow]{s.verdict}[/yellow]"
        table.add_row(s.motion, s.statement, s.measured, verdict)
    return table
