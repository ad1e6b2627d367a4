"""The command ``robofish sweep``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from fish_env.commands.numbers import console_for, write_json
from fish_env.commands.options import Address, Cpus, Json, Temp, TrustEffects
from fish_env.errors import Interrupted, missing_extra
from fish_env.files import check_outputs


def sweep(
    config: Annotated[str, typer.Argument(help="A YAML file, or a shipped training's name.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: out/sweep/NAME.", show_default=False)
    ] = None,
    seeds: Annotated[str, typer.Option(help="0,1,2 or 0-9.", show_default="the file's seed")] = "",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="KEY=VALUE,VALUE,...; may be given more than once."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(help="Number of steps, instead of the file's.")
    ] = None,
    address: Address = None,
    cpus: Cpus = None,
    temp: Temp = None,
    trust_effects: TrustEffects = False,
    json: Json = None,
) -> None:
    """Train under many seeds and settings, on all cores or on a Ray cluster.

    All combinations are trained. Each has a run folder as `robofish train` writes it, and a row in
    `sweep.csv`. Run the same command again to continue: each training continues from its
    checkpoint, and finished trainings are skipped. The exit status is 1 if one failed.

    **Example:** `robofish sweep ppo-hold --seeds 0-4 --set ppo.gamma=0.97,0.98,0.99`
    """
    try:
        from fish_env.cluster import ClusterSettings
        from robofish_agents.sweep.plan import plan
        from robofish_agents.sweep.run import FINISHED, PLAN, TABLE, run_sweep
        from robofish_agents.training.command import in_words
        from robofish_agents.training.config import files_behind
    except ModuleNotFoundError as error:
        raise missing_extra("A sweep", str(error.name), "ray") from error

    console = console_for(json)
    trials = plan(config, seeds, settings or (), steps, trust_effects)
    folder = out or Path("out/sweep") / trials[0].config.name
    check_outputs([json, folder / PLAN, folder / TABLE], files_behind(config, trials[0].config))

    def tell(name: str, row: dict[str, float]) -> None:
        console.print(f"{name}: {in_words(row)}", highlight=False, markup=False, soft_wrap=True)

    console.print(f"{len(trials)} trainings into {folder}", highlight=False, soft_wrap=True)
    try:
        rows = run_sweep(trials, folder, ClusterSettings(address, cpus, temp), tell)
    except KeyboardInterrupt:
        raise Interrupted(
            f"stopped; checkpoints stay in {folder}. Run the same command again to continue"
        ) from None
    finished = sum(row["state"] == FINISHED for row in rows)
    _report(console, rows, finished, str(folder / TABLE))
    if json is not None:
        write_json(console, json, {"trials": rows})
    if finished < len(rows):
        raise typer.Exit(1)


def _report(console: Console, rows: list[dict[str, Any]], finished: int, table: str) -> None:
    for row in rows:
        if row["reason"]:
            said = f"{row['trial']}: {row['state']}: {row['reason']}"
            console.print(said, highlight=False, markup=False, soft_wrap=True)
    ranked = sorted(
        (row for row in rows if "best_success_rate" in row),
        key=lambda row: (row["best_success_rate"], row["best_episode_return"]),
    )
    if ranked:
        best = ranked[-1]
        console.print(
            f"best: {best['trial']}, success {100 * best['best_success_rate']:.0f} %, return "
            f"{best['best_episode_return']:.1f}", highlight=False, markup=False, soft_wrap=True,
        )  # fmt: skip
    console.print(f"{finished} of {len(rows)} finished; table: {table}", soft_wrap=True)


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(sweep)
