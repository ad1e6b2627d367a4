"""`robofish leaderboard`: results of the agents on the frozen suites."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fish_env.commands.options import Json


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(leaderboard)


def leaderboard(
    add: Annotated[
        list[Path] | None,
        typer.Option("--add", help="Results of `robofish evaluate --json` to show as well."),
    ] = None,
    metric: Annotated[
        str | None, typer.Option(help="Show only this metric of the results, with its intervals.")
    ] = None,
    json: Json = None,
) -> None:
    """Show how the shipped agents do on the frozen suites, best return first.

    Each cell: success, RMSE of depth and of heading over whole episodes, mean power of the tail.

    **Example:** `robofish leaderboard --add mine.json --metric success_rate`
    """
    from rich.markdown import Markdown

    from fish_env.files import STANDARD, check_outputs
    from robofish_agents.evaluation.leaderboard import SHIPPED, by_metric, overview
    from robofish_agents.evaluation.results import read_results, write_results

    results = [row for file in (SHIPPED, *(add or [])) for row in read_results(file)]
    table = overview(results) if metric is None else by_metric(results, metric)
    if json is not None:
        check_outputs([json], [SHIPPED, *(add or [])])
        write_results(json, results)
        if str(json) == STANDARD:
            return
    console = Console()
    # A table in a file or a pipe is wanted as it stands in the README.
    if console.is_terminal:
        console.print(Markdown(table))
    else:
        print(table)
