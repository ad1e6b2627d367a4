"""Fits the fish of the measured runs, leaves its conditions out, and writes its parameter file.

Needs the folder of measured runs, which is not part of the repository:

    python -m scripts.fit_real_fish ../shared/data/msu-tail-fish
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from fish_env.data import Dataset, load_dataset
from fish_env.errors import DatasetError
from fish_env.params import load_fish, save_fish
from fish_env.studies.real_fish import (
    EFFECTS,
    PATHS,
    STEPS,
    TOLERANCE,
    WEIGHTS,
    RunError,
    covariance,
    errors_of,
    identified,
    leave_out,
    pace_of,
    repeat_scatter,
    summary,
)
from fish_env.studies.rollouts import WholeRuns
from fish_env.studies.tracks import Track, Weights, tracks_of
from fish_env.studies.whole_runs import RunFit, fit_runs

NAME = "msu-tail-fish-identified"
OUT = Path(__file__).resolve().parents[1] / "configs" / "fish" / f"{NAME}.yaml"
MODELS: dict[str, tuple[str, ...]] = {
    "with three effects": EFFECTS,
    "coefficients alone": (),
    "and tail_reactive": (*EFFECTS, "tail_reactive.scale"),
    "and tail_bias": (*EFFECTS, "tail_bias.offset"),
}
"""Models that are compared; the one with `EFFECTS` is written."""
FORGIVING = (Weights(), Weights(0.004, 0.05, 0.0015, 0.008, 5.0))
"""Weights of the first steps: they let a run drift, so that a start far off still finds its way."""
WIDTH = 130
COLUMNS = ("surge", "surge_percent", "sway", "yaw_rate", "yaw_rate_percent", "radius_percent")


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    console = Console(width=WIDTH)
    tracks = read(options.folder)
    rows: dict[str, dict[str, float]] = {}
    kept: dict[str, list[RunError]] = {}
    first = fitted((), tracks, None)
    written = fitted(EFFECTS, tracks, first)
    nominal = WholeRuns(load_fish("msu-tail-fish"), PATHS)
    kept["starting values"] = errors_of(nominal, np.zeros(nominal.size), tracks, 1.0)
    for label, effects in MODELS.items():
        if options.quick and effects != EFFECTS:
            continue
        console.print(f"{label} ...")
        known = {(): first, EFFECTS: written}
        whole = known[effects] if effects in known else fitted(effects, tracks, written)
        kept[label] = leave_out(whole.model, tracks, whole, console.print)
        if effects == EFFECTS:
            source = f"identified from {len(tracks)} runs of msu-tail-fish over their whole length"
            save_fish(identified(whole, tracks, NAME, source), options.out)
            show_values(console, whole, tracks)
            kept["three effects, not left out"] = errors_of(
                whole.model, whole.x, tracks, pace_of(whole)
            )
    rows = {label: summary(errors) for label, errors in kept.items()}
    show_errors(console, rows, tracks)
    if options.results is not None:
        write(options.results, rows, kept)
    console.print(f"written: {options.out}")


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the measured runs")
    parser.add_argument("--out", type=Path, default=OUT, help="parameter file to write")
    parser.add_argument("--results", type=Path, help="JSON file for all errors")
    parser.add_argument("--quick", action="store_true", help="only the model that is written")
    return parser.parse_args(arguments)


def read(folder: Path) -> tuple[Track, ...]:
    dataset = load_dataset(folder)
    if not isinstance(dataset, Dataset):
        raise DatasetError(f"{folder}: a table of steady motion; give the runs over time")
    return tracks_of(dataset)


def fitted(effects: tuple[str, ...], tracks: Sequence[Track], near: RunFit | None) -> RunFit:
    """A fit of the coefficients and some effects to all runs, from a simpler fit.

    There is more than one optimum. Coefficients fitted without the effects have gone far to make
    up for them, so half of that is taken back; from a fit with effects they go on as they are.
    """
    model = WholeRuns(load_fish("msu-tail-fish"), PATHS, effects)
    if near is None:
        near = fit_runs(model, tracks, FORGIVING[0], np.zeros(model.size))
    share = 1.0 if near.model.effects or not effects else 0.5
    known = dict(zip(near.model.names, share * near.x, strict=True))
    x = np.array([known.get(name, 0.3) for name in model.names])
    near = fit_runs(model, tracks, FORGIVING[1], x, near.starts)
    return fit_runs(model, tracks, WEIGHTS, near.x, near.starts, STEPS, TOLERANCE)


def show_values(console: Console, fit: RunFit, tracks: Sequence[Track]) -> None:
    table = Table(title="Estimates on all runs, 95 % intervals")
    for heading in ("number", "before", "found", "interval", "prior sds off"):
        table.add_column(heading, no_wrap=True)
    values = fit.model.values(fit.x[:, None])[:, 0]
    before = fit.model.values(np.zeros((fit.model.size, 1)))[:, 0]
    sd = np.sqrt(np.diag(covariance(fit, tracks)))
    bounds = fit.model.physical_bounds
    for i, name in enumerate(fit.model.names):
        low, high = values[i] - 1.96 * sd[i], values[i] + 1.96 * sd[i]
        low, high = max(low, bounds[0][i]), min(high, bounds[1][i])
        row = (f"{before[i]:.4g}", f"{values[i]:.4g}", f"{low:.3g} to {high:.3g}")
        table.add_row(name, *row, f"{fit.x[i]:+.1f}")
    console.print(table)
    console.print(f"tail frequency over the commanded one: {pace_of(fit):.3f}")


def show_errors(
    console: Console, rows: dict[str, dict[str, float]], tracks: Sequence[Track]
) -> None:
    table = Table(title="Errors on conditions left out, root mean square over runs")
    for heading in ("model", "surge mm/s", "%", "sway mm/s", "yaw rate mrad/s", "%", "radius %"):
        table.add_column(heading)
    table.add_column("path mm")
    table.add_column("yaw rad")
    for label, row in rows.items():
        values = [row[c] * (1.0 if c.endswith("percent") else 1e3) for c in COLUMNS]
        cells = [f"{value:.1f}" for value in values]
        table.add_row(label, *cells, f"{1e3 * row['path']:.0f}", f"{row['yaw']:.3f}")
    surge, sway, rate = 1e3 * repeat_scatter(tracks)
    cells = [f"{surge:.1f}", "", f"{sway:.1f}", f"{rate:.1f}", "", "", "", ""]
    table.add_row("scatter between repeats", *cells)
    console.print(table)


def write(file: Path, rows: dict[str, dict[str, float]], kept: dict[str, list[RunError]]) -> None:
    content = {"summary": rows, "runs": {k: [asdict(e) for e in v] for k, v in kept.items()}}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
