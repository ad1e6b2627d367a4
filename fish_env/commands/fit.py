"""`robofish fit`: a fish's coefficients from measured runs, written as a fish of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from fish_env.data import dataset_files
from fish_env.diagnosis.input_checks import check_runs, divergence, load_runs
from fish_env.diagnosis.inputs.check import refuse_wrong_inputs
from fish_env.effects.extended import PREFIX
from fish_env.files import check_outputs
from fish_env.identification import Fit, SeriesProblem, fit
from fish_env.identification.series import series_of
from fish_env.identification.starts import likely_start
from fish_env.identification.writing import identified_fish
from fish_env.params import fish_files, fish_outputs, load_fish, save_fish


def fit_dataset(
    console: Console,
    dataset: str,
    fish: str | None,
    effects: tuple[str, ...],
    out: Path,
    trust_effects: bool = False,
) -> Fit:
    """Fits a fish to measured runs, prints what was found and writes the fish.

    Args:
        console: Where the tables go.
        dataset: Folder, or name of a shipped dataset, of runs over time.
        fish: Another fish than the dataset names: preset or file.
        effects: Effects whose parameters are free beside the coefficients.
        out: The file to write.
        trust_effects: Run the effect files that the fish's file names.

    Raises:
        RoboticFishError: The data or the fish cannot be used.
    """
    measured = load_runs(dataset)
    check_runs(measured)
    chosen = load_fish(fish or measured.fish, trust_effects)
    refuse_wrong_inputs(measured, chosen)
    with console.status("reading runs") as status:
        read = [*dataset_files(dataset), *fish_files(chosen)]
        check_outputs(fish_outputs(chosen, out).values(), read)
        problem = SeriesProblem(measured, chosen, effects=effects)
        status.update("looking for a start")
        start = likely_start(problem, problem.effects)
        try:
            result = fit(problem, start=start, report=status.update).extrapolated
        except np.linalg.LinAlgError:
            raise divergence(problem) from None
    save_fish(identified_fish(result, out.stem), out)
    print_fit(console, result)
    console.print(f"written: {out}", soft_wrap=True)
    return result


def print_fit(console: Console, result: Fit) -> None:
    """Prints estimates (SI) beside what was believed before, then noise and conditioning."""
    table = Table(box=box.SIMPLE, title=series_of(result).dataset.name, padding=(0, 1, 0, 0))
    table.add_column("parameter", no_wrap=True)
    for heading in ("before, prior sd", "found, 95 % interval", "moved"):
        table.add_column(heading, justify="right")
    for i, name in enumerate(result.names):
        table.add_row(*_row(result, i, name))
    console.print(table)
    noise = result.noise
    console.print(
        f"disturbance found: {1e3 * noise.force_sd:.3g} mN, {1e3 * noise.moment_sd:.3g} mN m, "
        f"correlated over {noise.correlation_s:.2g} s"
    )
    sensors = zip(series_of(result).channels, noise.sensor_sd, strict=True)
    console.print("sensor noise found: " + ", ".join(f"{n} {sd:.2g}" for n, sd in sensors))
    left = float(np.sqrt(np.mean(result.linearised.residuals**2)))
    console.print(
        f"prediction errors: {left:.2f} of what noise explains; "
        f"condition number {result.condition:.2g}"
    )
    if result.at_bounds:
        console.print(f"at a bound: {', '.join(result.at_bounds)}")


def _row(result: Fit, i: int, name: str) -> tuple[str, ...]:
    """Name, value and spread before, value and interval found, and how far it moved."""
    low, high = result.interval(name)
    found = f"{result.estimates[i]:.4g}  {low:.3g} to {high:.3g}"
    if name.startswith(PREFIX):
        effect, parameter = name.removeprefix(PREFIX).split(".")
        return name, f"{result.problem.known[effect].neutral[parameter]:.4g}", found, "-"
    info = series_of(result).fish.info(name)
    moved = (result.estimates[i] - info.value) / info.prior_sd
    return name, f"{info.value:.4g}, {info.prior_sd:.2g}", found, f"{moved:+.1f} sd"
