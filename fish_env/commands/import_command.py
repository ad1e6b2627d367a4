"""The options of `robofish import`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fish_env.commands.options import Json


def import_command(
    logs: Annotated[
        list[str],
        typer.Argument(
            help="Logs: files, folders, or patterns such as 'runs/*.csv'.", metavar="LOG"
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of the dataset to write.")],
    mapping: Annotated[
        Path | None, typer.Option(help="A mapping (YAML) to use; without it, one is guessed.")
    ] = None,
    fish: Annotated[str | None, typer.Option(help="The fish: preset or parameter file.")] = None,
    frame: Annotated[
        str | None, typer.Option(help="ned (z down) or enu (z up), if the logs do not say.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the dataset.")] = None,
    run_column: Annotated[
        str | None, typer.Option(help="Column whose value names the run, in a table of runs.")
    ] = None,
    start: Annotated[str | None, typer.Option(help="rest: each run began level and still.")] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Accept all guesses without asking; print them.")
    ] = False,
    json: Json = None,
) -> None:
    """Import logs: ROS bags, MATLAB, Parquet, Excel, CSV of any shape.

    Guesses the meaning of each column, shows the guesses and a picture of each run, and writes
    a dataset once you confirm. It also writes the mapping `import.yaml`, for `--mapping`.

    **Example:** `robofish import trial1.bag trial2.bag --out trials --fish zheng-2021-a`
    """
    from fish_env.commands.import_logs import Told, import_logs, in_numbers
    from fish_env.commands.numbers import console_for, write_json

    console = console_for(json)
    ask = console.input if sys.stdin.isatty() else None
    told = Told(fish, frame, name, run_column, start)
    imported = import_logs(console, logs, out, mapping, told, yes, ask, json)
    if imported is None:
        raise typer.Exit(1)
    if json is not None:
        write_json(console, json, in_numbers(imported, out))
