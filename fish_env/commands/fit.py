"""`robofish fit`: a fish's coefficients from measured data, written as a fish of its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from fish_env.data import dataset_files, load_dataset
from fish_env.data.schema import Dataset
from fish_env.diagnosis.input_checks import check_runs
from fish_env.diagnosis.inputs.check import refuse_wrong_inputs
from fish_env.errors import DatasetError
from fish_env.files import check_outputs
from fish_env.identification.dataset_fit import AUTO, DatasetFit, Estimate, fit_dataset
from fish_env.identification.left_out import mean_errors
from fish_env.identification.series import SeriesProblem
from fish_env.params import fish_files, fish_outputs, load_fish
from fish_env.params.io import check_tables
from fish_env.params.schema import FishParams

SHOWN = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "rad/s": ("mrad/s", 1e3), "rad": ("mrad", 1e3)}
"""Unit in which an error is printed, and its size."""


def fit_and_write(
    console: Console,
    dataset: str,
    fish: str | None,
    effects: Sequence[str],
    out: Path,
    trust_effects: bool = False,
    objective: str | None = None,
    leave_out: str | None = None,
    results: Path | None = None,
    trust_inputs: bool = False,
) -> DatasetFit:
    """Fits a fish to measured data, prints what was found and writes the fish.

    Args:
        console: Where the tables go.
        dataset: Folder, or name of a shipped dataset.
        fish: Another fish than the dataset names: preset or file.
        effects: Effects whose parameters are free beside the coefficients, or "auto".
        out: The parameter file to write.
        trust_effects: Run the effect files that the fish's file names.
        objective: `one-step`, `whole-run` or `means`; None for that of the kind of data.
        leave_out: Column whose values are left out one by one; None for none.
        results: JSON file for estimates and errors; None for none.
        trust_inputs: Take signs, units and clocks as they are declared.

    Raises:
        RoboticFishError: The data, the fish or an option cannot be used, or an output would
            replace what is read, or a table of someone else.
    """
    measured = load_dataset(dataset)
    chosen = load_fish(fish or measured.fish, trust_effects)
    if isinstance(measured, Dataset):
        check_runs(measured)
        if not trust_inputs:
            _check_inputs(measured, chosen)
    written = [*fish_outputs(chosen, out).values(), *([results] if results else [])]
    check_outputs(written, [*dataset_files(dataset), *fish_files(chosen)])
    check_tables(chosen, out)
    with console.status("reading data") as status:
        try:
            found = fit_dataset(
                measured, chosen, objective=objective, effects=effects, leave_out=leave_out,
                report=status.update,
            )  # fmt: skip
        except np.linalg.LinAlgError:
            raise DatasetError(
                f"{measured.name}: the simulation diverges while {chosen.name} is fitted to these "
                "data; check that fish, units and frame are those of the data"
            ) from None
    found.write(out, results)
    print_fit(console, found)
    console.print(f"written: {out}", soft_wrap=True)
    return found


def _check_inputs(measured: Dataset, fish: FishParams) -> None:
    """Refuse wrong signs, units and clocks, and say how to fit nevertheless."""
    try:
        refuse_wrong_inputs(measured, fish)
    except DatasetError as error:
        raise DatasetError(f"{error} To fit the data as they are, add --trust-inputs.") from None


def print_fit(console: Console, result: DatasetFit) -> None:
    """Prints estimates (SI) beside the values before, noise, conditioning and errors."""
    table = Table(box=box.SIMPLE, title=result.dataset, padding=(0, 1, 0, 0))
    table.add_column("parameter", no_wrap=True)
    for heading in ("before", "found, 95 % interval", "moved"):
        table.add_column(heading, justify="right")
    for estimate in result.estimates:
        table.add_row(*_row(estimate))
    console.print(table)
    _print_noise(console, result)
    left = float(np.sqrt(np.mean(result.fit.linearised.residuals**2)))
    console.print(
        f"prediction errors: {left:.2f} times the noise; "
        f"condition number {result.fit.condition:.2g}"
    )
    if result.fit.at_bounds:
        console.print(f"at a bound: {', '.join(map(str, result.fit.at_bounds))}")
    if result.unseen:
        console.print(f"not fitted, because these runs do not show it: {', '.join(result.unseen)}")
    for step in result.steps:
        verdict = "added" if step.added else "not added"
        console.print(
            f"{step.effect}: held-out errors fall by {100 * step.gain:.1f} % "
            f"(p = {step.p_value:.2g}), {verdict}"
        )
    _print_errors(console, result)


def _print_noise(console: Console, result: DatasetFit) -> None:
    problem, noise = result.fit.problem, result.fit.noise
    if not isinstance(problem, SeriesProblem):
        return
    console.print(
        f"disturbance found: {1e3 * noise.force_sd:.3g} mN, {1e3 * noise.moment_sd:.3g} mN m, "
        f"correlated over {noise.correlation_s:.2g} s"
    )
    sensors = zip(problem.channels, noise.sensor_sd, strict=True)
    console.print("sensor noise found: " + ", ".join(f"{n} {sd:.2g}" for n, sd in sensors))


def _print_errors(console: Console, result: DatasetFit) -> None:
    """Mean absolute errors by quantity: of the fit, and of what it has not seen."""
    table = Table(
        box=box.SIMPLE, title=f"mean absolute errors, {result.objective}", padding=(0, 1, 0, 0)
    )
    table.add_column("quantity", no_wrap=True)
    table.add_column("fitted", justify="right")
    if result.held_out:
        table.add_column(f"{result.left_out} left out", justify="right")
    held_out = result.mean_held_out
    for name, value in mean_errors(result.errors).items():
        unit, size = SHOWN.get(result.units[name], (result.units[name], 1.0))
        cells = [f"{size * value:.3g} {unit}"]
        if result.held_out:
            cells.append(f"{size * held_out[name]:.3g} {unit}" if name in held_out else "-")
        table.add_row(name, *cells)
    console.print(table)


def _row(estimate: Estimate) -> tuple[str, ...]:
    """Name, value before, value and interval found, and how far it moved."""
    found = f"{estimate.value:.4g}  {estimate.low:.3g} to {estimate.high:.3g}"
    off = estimate.prior_sds_off
    moved = "-" if off is None else f"{off:+.1f} sd"
    return estimate.name, f"{estimate.before:.4g} {estimate.unit}", found, moved


def effects_from(text: str) -> Sequence[str]:
    """Names of effects in an option, a comma between, or ``auto``."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    return AUTO if names == (AUTO,) else names
