"""`robofish evaluate`: an agent on the frozen suites."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from fish_env.errors import ConfigError

if TYPE_CHECKING:
    from agents.evaluation.results import Result

ALL = "all"


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(evaluate)


def evaluate(
    agent: Annotated[
        str, typer.Option(help="pid, mppi, pretrained, or a policy file or folder of them.")
    ],
    suite: Annotated[
        str, typer.Option(help="calm, current, noisy, hard, a file, or all of the four.")
    ] = ALL,
    task: Annotated[str, typer.Option(help="hold, track, or both.")] = "both",
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Only the first so many, for a first look.")
    ] = None,
    json: Annotated[Path | None, typer.Option(help="File for all numbers.")] = None,
) -> None:
    """Measure an agent on frozen sets of episodes, with 95 % intervals.

    `calm` is still water and exact sensors, `current` a steady flow, `noisy` has noise and delays,
    `hard` all of it on another fish in each episode. A folder of policies counts as one agent
    trained with several seeds.

    **Example:** `robofish evaluate --agent pid --suite calm --json pid.json`
    """
    from rich.progress import Progress

    from agents.evaluation.results import evaluate as measure
    from agents.evaluation.results import write_results
    from agents.evaluation.suites import load_suite, suite_names
    from agents.registry import load_agents

    console = Console()
    suites = [load_suite(name) for name in (suite_names() if suite == ALL else [suite])]
    chosen = [(one, each, load_agents(agent, each)) for one in suites for each in task_names(task)]
    results = []
    with Progress(console=console, transient=True) as progress:
        total = sum(one.episode_steps * len(loaded) for one, _, loaded in chosen)
        bar = progress.add_task(f"swimming {agent}", total=total)
        for one, each, loaded in chosen:
            report = lambda: progress.advance(bar)  # noqa: E731
            results.append(measure(agent, loaded, one, each, episodes, report=report))
    print_results(console, results)
    if json is not None:
        write_results(json, results)
        console.print(f"written: {json}", soft_wrap=True)


def task_names(task: str) -> list[str]:
    """The tasks that an option names.

    Raises:
        ConfigError: neither a task nor "both".
    """
    from fish_env.envs.tasks import TASKS

    if task == "both":
        return list(TASKS)
    if task not in TASKS:
        raise ConfigError(f"task '{task}': one of {', '.join(TASKS)}, or both")
    return [task]


def print_results(console: Console, results: list[Result]) -> None:
    """Prints one table, a column for each suite and task."""
    from rich.table import Table

    first = results[0]
    seeds = f", {first.seeds} training seeds" if first.seeds > 1 else ""
    table = Table(title=f"{first.agent}: {first.episodes} episodes each{seeds}", box=None)
    table.add_column("mean, 95 % interval")
    for result in results:
        table.add_column(f"{result.suite}\n{result.task}", justify="right")
    names = dict.fromkeys(name for result in results for name in result.metrics)
    for name in names:
        cells = [result.metrics.get(name) for result in results]
        table.add_row(name, *(_cell(cell) for cell in cells))
    console.print(table)


def _cell(interval: tuple[float, float, float] | None) -> str:
    if interval is None:
        return "-"
    mean, low, high = interval
    return f"{mean:.3g}\n[dim]{low:.3g} to {high:.3g}[/dim]"
