"""`robofish campaign`: many data sets diagnosed, on all cores or on a cluster."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from fish_env.commands.options import (
    Address,
    Cpus,
    Json,
    MeasuredBeats,
    OtherFish,
    Patient,
    Quick,
    Seed,
    Temp,
    TrustEffects,
)
from fish_env.errors import DatasetError, Interrupted
from fish_env.files import check_outputs

if TYPE_CHECKING:
    from fish_env.campaign import Options, Row
    from fish_env.cluster import ClusterSettings


def campaign(
    data: Annotated[
        list[str],
        typer.Argument(
            help="Folders of data sets, folders of such folders, or patterns such as 'trials/*'.",
            metavar="FOLDER_OR_GLOB",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of results.")],
    fish: OtherFish = None,
    quick: Quick = False,
    measured_beats: MeasuredBeats = False,
    seed: Seed = 0,
    address: Address = None,
    cpus: Cpus = None,
    temp: Temp = None,
    trust_effects: TrustEffects = False,
    json: Json = None,
    patient: Patient = False,
) -> None:
    """Diagnose many data sets on all cores, or on the machines of a Ray cluster.

    Each data set gets a folder with the files of `robofish diagnose`, and a line in `campaign.csv`.
    Run the same command again to continue; finished data sets are skipped. The exit status is 1 if
    one failed.

    **Example:** `robofish campaign 'trials/*' --out results`
    """
    from fish_env.campaign import Options
    from fish_env.campaign.run import FAILED
    from fish_env.cluster import ClusterSettings
    from fish_env.commands.numbers import console_for, write_json

    options = Options(fish, seed, quick, measured_beats, trust_effects, patient)
    console = console_for(json)
    if json is not None:
        _check_json(json, data, out)
    rows = diagnose_many(console, data, out, options, ClusterSettings(address, cpus, temp))
    if json is not None:
        write_json(console, json, {"cases": [asdict(row) for row in rows]})
    if any(row.state == FAILED for row in rows):
        raise typer.Exit(1)


def _check_json(file: Path, patterns: Sequence[str], out: Path) -> None:
    from fish_env.campaign import find_cases
    from fish_env.campaign.run import TABLE
    from fish_env.data import dataset_files

    check_outputs([out / TABLE, file])
    for case in find_cases(patterns):
        with suppress(DatasetError):  # such a data set gets a row with the reason
            check_outputs([file], dataset_files(case.source))


def diagnose_many(
    console: Console,
    patterns: Sequence[str],
    out: Path,
    options: Options,
    cluster: ClusterSettings,
) -> list[Row]:
    """Diagnoses data sets, a line for each as it ends, and says where the results are.

    Args:
        console: where the words go.
        patterns: folders, patterns and names of data sets.
        out: folder of results.
        options: how each is diagnosed.
        cluster: where the work is done.

    Raises:
        RoboticFishError: no data set, no Ray, no cluster, or a result that cannot be written.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from fish_env.campaign import find_cases, run_campaign
    from fish_env.campaign.run import FAILED, TABLE

    cases = find_cases(patterns)
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("diagnosing", total=len(cases))

        def tell(row: Row) -> None:
            bar.advance(task)
            bar.console.print(in_words(row), highlight=False, markup=False, soft_wrap=True)

        try:
            rows = run_campaign(cases, out, options, cluster, tell)
        except KeyboardInterrupt:
            raise Interrupted(
                f"stopped; finished results stay in {out}. Run the same command again to continue"
            ) from None
    failed = sum(row.state == FAILED for row in rows)
    console.print(
        f"{len(rows) - failed} of {len(rows)} finished; table: {out / TABLE}",
        highlight=False, markup=False, soft_wrap=True,
    )  # fmt: skip
    return rows


def in_words(row: Row) -> str:
    """One data set in a line."""
    from fish_env.campaign.run import FAILED

    if row.state == FAILED:
        return f"{row.name}: failed: {row.reason}"
    return f"{row.name}: {row.verdict} {row.causes}".rstrip()
