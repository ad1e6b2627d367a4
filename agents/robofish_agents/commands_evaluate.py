"""`robofish evaluate`: an agent on the frozen suites."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from fish_env.commands.options import Json, TrustEffects
from fish_env.errors import ConfigError
from fish_env.files import STANDARD, check_outputs

if TYPE_CHECKING:
    from rich.table import Table

    from robofish_agents.evaluation.results import Result

ALL = "all"


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(evaluate)


def evaluate(
    agent: Annotated[
        str, typer.Option(help="pid, mppi, pretrained, or a policy file or folder of them.")
    ],
    suite: Annotated[
        str,
        typer.Option(help="calm, current, noisy, hard, path/..., station/..., a file, or all."),
    ] = ALL,
    task: Annotated[
        str, typer.Option(help="hold, track, path, station, both (hold and track), or all.")
    ] = ALL,
    episodes: Annotated[
        int | None, typer.Option(min=1, help="Number of episodes, from the first one.")
    ] = None,
    json: Json = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Measure an agent on frozen sets of episodes, with 95 % intervals.

    The suite `calm` has still water and exact sensors, `current` a steady flow, and `noisy` noise
    and delays. `hard` has all of these, and another fish in each episode. `path/helix`,
    `path/waypoints`, `path/figure` and `path/current` are paths to follow. `station/current` and
    `station/waves` are places to keep. A folder of policies counts as one agent trained with
    several seeds.

    **Example:** `robofish evaluate --agent pid --suite calm --json pid.json`
    """
    from rich.progress import Progress

    from fish_env.commands.numbers import console_for
    from robofish_agents.evaluation.results import evaluate as measure
    from robofish_agents.evaluation.results import write_results
    from robofish_agents.evaluation.suites import load_suite, suite_files, suite_names
    from robofish_agents.registry import agent_files, load_agents

    console = console_for(json)
    tasks = task_names(task)
    names = suite_names(*tasks) if suite == ALL else [suite]
    read = [file for name in names for file in suite_files(name)]
    check_outputs([json], [*read, *agent_files(agent)])
    suites = [load_suite(name, trust_effects) for name in names]
    chosen = [
        (one, each, load_agents(agent, each))
        for one in suites
        for each in tasks
        if each in one.tasks or task != ALL
    ]
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
        if str(json) != STANDARD:
            console.print(f"written: {json}", soft_wrap=True)


def task_names(task: str) -> list[str]:
    """The tasks that an option names.

    Raises:
        ConfigError: neither a task nor "both" nor "all".
    """
    from fish_env.envs.tasks import SIGNAL_TASKS, TASKS

    if task == ALL:
        return list(TASKS)
    if task == "both":
        return list(SIGNAL_TASKS)
    if task not in TASKS:
        raise ConfigError(f"task '{task}': one of {', '.join(TASKS)}, both, or all")
    return [task]


def print_results(console: Console, results: list[Result]) -> None:
    """Prints a table for each task, a column for each suite."""
    for task in dict.fromkeys(result.task for result in results):
        console.print(_table(task, [result for result in results if result.task == task]))


def _table(task: str, results: list[Result]) -> Table:
    from rich.table import Table

    from robofish_agents.evaluation.labels import LABELS, mean_and_range

    first = results[0]
    seeds = f", {first.seeds} training seeds" if first.seeds > 1 else ""
    title = f"{first.agent}, task {task}: {first.episodes} episodes each{seeds}"
    table = Table(title=title, caption="mean, and its 95 % interval", box=None)
    table.add_column("")
    for result in results:
        table.add_column(result.suite, justify="right")
    for name in first.metrics:
        cells = ("\n".join(mean_and_range(name, result.metrics[name])) for result in results)
        table.add_row(LABELS[name][0], *cells)
    return table
