"""`robofish replay`: a page with swimming fish, from files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from fish_env.commands.case import Case, read_case
from fish_env.comparison import RunsComparison
from fish_env.data import Dataset
from fish_env.data.description import FILE_NAME
from fish_env.files import STANDARD, check_outputs
from fish_env.params import FishParams, fish_files, load_fish
from fish_env.replay import Group, motion_from_run, motion_from_trajectory, write_replay
from fish_env.replay.reading import read_replay_file
from fish_env.simulator import Simulator

DEFAULT_FISH = "zheng-2021-a"
RATE_HZ = 50.0
"""Samples a second of a simulation made for a replay: a beat at 2 Hz has 25."""


def replay_files(
    console: Console, files: Sequence[Path], out: Path, fish: str | None, case_file: Path | None
) -> Path:
    """Writes a replay of trajectory files, all at once.

    Args:
        console: Where the page is named.
        files: CSV or Parquet.
        out: The page.
        fish: Preset or file, for the drawn size; default: the case's or dataset's.
        case_file: Case the files were simulated from, for tail and block.

    Raises:
        RoboticFishError: A file cannot be read, or would be replaced by the page.
    """
    case = read_case(case_file) if case_file else None
    check_outputs([out], [*files, *(file.with_name(FILE_NAME) for file in files), case_file])
    phase = case.initial.tail_phase if case else None
    read = [read_replay_file(file, case.commands if case else None, phase) for file in files]
    named = fish or next((item.fish for item in read if item.fish), None)
    shown = load_fish(named) if named else case.fish if case else load_fish(DEFAULT_FISH)
    check_outputs([out], fish_files(shown))
    title = ", ".join(item.motion.name for item in read)
    group = Group(title, tuple(item.motion for item in read))
    return _written(console, [group], shown, out, f"Replay of {title}")


def replay_case(console: Console, case: Case, dt: float, name: str, out: Path) -> Path:
    """Writes a replay of a case, simulated anew at a rate that shows the tail.

    Args:
        console: Where the page is named.
        case: What to simulate.
        dt: Longest physics step, s.
        name: For the legend.
        out: The page.
    """
    simulator = Simulator(case.fish, dt, case.effects)
    trajectory = simulator.run(case.commands, case.duration_s, case.initial, RATE_HZ)
    tail = simulator.outputs(trajectory)["tail_angle"]
    group = Group(name, (motion_from_trajectory(trajectory, name, tail_angle=tail),))
    return _written(console, [group], case.fish, out, f"{name}: {case.fish.name}")


def replay_comparison(
    console: Console,
    dataset: Dataset,
    comparison: RunsComparison,
    fish: FishParams,
    dt: float,
    out: Path,
) -> Path:
    """Writes a replay of every run of a comparison, measured beside simulated.

    Args:
        console: Where the page is named.
        dataset: The measured runs.
        comparison: Where each simulation started.
        fish: The simulated fish.
        dt: Longest physics step, s.
        out: The page.
    """
    simulator, groups = Simulator(fish, dt), []
    for compared in comparison.runs:
        run = dataset.run(compared.id)
        trajectory = simulator.run(run.commands, initial=compared.start, sample_times_s=run.time_s)
        tail = simulator.outputs(trajectory)["tail_angle"]
        channels = dict(trajectory.channels) | dict(compared.simulated)
        simulated = motion_from_trajectory(trajectory, "simulated", "baseline", tail, channels)
        groups.append(Group(run.id, (motion_from_run(run), simulated)))
    return _written(console, groups, fish, out, f"{comparison.dataset}: measured and simulated")


def _written(
    console: Console, groups: Sequence[Group], fish: FishParams, out: Path, title: str
) -> Path:
    page = write_replay(groups, fish, out, title)
    if str(page) == STANDARD:
        return page
    size = page.stat().st_size / 1e6
    console.print(f"replay: {page} ({size:.1f} MB), open it in a browser", soft_wrap=True)
    return page
