"""Output of `robofish train`: a progress bar, a line for each evaluation, and the result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from fish_env.errors import Interrupted
from fish_env.files import check_outputs
from robofish_agents.training.card import shares
from robofish_agents.training.config import (
    DEFAULT_ENGINE,
    TrainConfig,
    files_behind,
    load_train_config,
)
from robofish_agents.training.run import CHECKPOINT, CONFIG, Outcome, outputs, train


class Screen:
    """Shows steps as a bar and evaluations as lines.

    Args:
        bar: rich's progress display.
        total: steps of the whole training.
    """

    def __init__(self, bar: Progress, total: int) -> None:
        self._bar = bar
        self._task = bar.add_task("training", total=total)

    def stepped(self, steps: int) -> None:
        """Moves the bar."""
        self._bar.update(self._task, completed=steps)

    def evaluated(self, row: dict[str, float]) -> None:
        """Prints an evaluation."""
        self._bar.console.print(in_words(row), highlight=False, soft_wrap=True)


def in_words(row: dict[str, float]) -> str:
    """Returns one evaluation as a line of text."""
    return (
        f"{row['steps']:>10,.0f} steps, {row['cpu_s']:6.1f} s of processor: "
        f"success {100 * row['success_rate']:3.0f} % "
        f"(worst {100 * row['worst_success_rate']:.0f}), return {row['episode_return']:6.1f}, "
        f"depth {100 * row['depth_rmse_m']:.1f} cm, "
        f"heading {np.degrees(row['heading_rmse_rad']):.1f} degrees rms, "
        f"{1000 * row['mean_power_w']:.0f} mW"
    )


def run(
    console: Console,
    source: str,
    out: Path | None,
    seed: int | None,
    steps: int | None,
    resume: bool,
    trust_effects: bool = False,
    engine: str | None = None,
    json_file: Path | None = None,
) -> Outcome:
    """Trains with the options of the command line.

    Args:
        console: where words go.
        source: configuration, a path or a shipped one's name.
        out: folder, or None for the usual place.
        seed: instead of the configuration's.
        steps: instead of the configuration's.
        resume: continue the training in the folder.
        trust_effects: run the effect files that the fish's file names.
        engine: library that learns, instead of the configuration's.
        json_file: file that the caller writes with the outcome; refused if it is read.
    """
    config = load_train_config(source, trust_effects, seed=seed, total_steps=steps, engine=engine)
    folder = out or Path("out/train") / f"{config.name}-seed-{config.seed}"
    written = [file for file in outputs(folder) if not (resume and file.name == CONFIG)]
    check_outputs([*written, json_file], files_behind(source, config))
    console.print(
        f"training {config.name}, seed {config.seed}, into {folder}",
        highlight=False,
        soft_wrap=True,
    )
    columns = (
        BarColumn(), TextColumn("{task.completed:,.0f} of {task.total:,.0f} steps"),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True) as bar:
        try:
            outcome = train(config, folder, Screen(bar, config.total_steps), resume)
        except KeyboardInterrupt:
            raise Interrupted(_stopped(source, folder, config)) from None
    _report(console, config, outcome)
    return outcome


def _stopped(source: str, folder: Path, config: TrainConfig) -> str:
    """Returns what was kept of a stopped training, and how to continue."""
    options = f"--out {folder} --seed {config.seed} --steps {config.total_steps}"
    if config.engine != DEFAULT_ENGINE:
        options += f" --engine {config.engine}"
    if not (folder / CHECKPOINT).exists():
        return (
            f"stopped before the first checkpoint; start again: robofish train {source} {options}"
        )
    return (
        f"stopped; {folder / CHECKPOINT} keeps the training up to the last checkpoint. "
        f"Continue with: robofish train {source} {options} --resume"
    )


def _report(console: Console, config: TrainConfig, outcome: Outcome) -> None:
    progress = outcome.progress
    parts = shares(progress, progress.env_cpu_s)
    divided = ", ".join(f"{name} {100 * share:.0f} %" for name, share in parts.items())
    console.print(
        f"{progress.steps:,} steps in {progress.cpu_s:.1f} s of processor time "
        f"({progress.wall_s:.1f} s of wall-clock time): "
        f"{progress.steps / progress.cpu_s:,.0f} a second; {divided}\n"
        f"best evaluation, after {outcome.best['steps']:,.0f} steps: success "
        f"{100 * outcome.best['success_rate']:.0f} %\n"
        f"policy: {outcome.policy}  (robofish evaluate --agent {outcome.policy} --suite "
        f"{config.disturbances[-1]})",
        highlight=False,
        soft_wrap=True,
    )
