"""A small dataset that the package's own simulator swam, to be spoilt in one way or another."""

from __future__ import annotations

import csv
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fish_env import InitialState, Simulator, schedule
from fish_env.data import COMMANDS

NOISE = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("roll", "pitch", "yaw"), 0.005),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
UNITS = {**dict.fromkeys(("x", "y", "z"), "m"), **dict.fromkeys(("roll", "pitch", "yaw"), "rad"),
         **dict.fromkeys(("p", "q", "r"), "rad/s")}  # fmt: skip
COMMAND_UNITS = dict(zip(COMMANDS, ("rad", "rad", "Hz", "m", "rad"), strict=True))
Columns = dict[str, np.ndarray]


@dataclass
class Pool:
    """What will be written: dataset.yaml's content, and columns by run."""

    description: dict[str, Any]
    runs: dict[str, Columns]
    raw: dict[str, str] = field(default_factory=dict)

    def each(self, change: Callable[[Columns], Columns | None]) -> None:
        """Changes every run; a change may work in place."""
        for id, columns in self.runs.items():
            self.runs[id] = change(columns) or columns

    def entry(self, id: str) -> dict[str, Any]:
        """A run's entry in dataset.yaml."""
        return next(entry for entry in self.description["runs"] if entry["id"] == id)

    def add(self, id: str, columns: Columns) -> None:
        """One more run, declared as the first is."""
        self.runs[id] = {name: values.copy() for name, values in columns.items()}
        new = self.description["runs"][0] | {"id": id, "file": f"{id}.csv"}
        self.description["runs"].append(new)

    def write(self, folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        text = yaml.safe_dump(self.description, sort_keys=False)
        (folder / "dataset.yaml").write_text(text, encoding="utf-8")
        for id, columns in self.runs.items():
            with (folder / f"{id}.csv").open("w", encoding="utf-8", newline="") as stream:
                writer = csv.writer(stream, lineterminator="\n")
                writer.writerow(columns)
                rows = zip(*(values.tolist() for values in columns.values()), strict=True)
                writer.writerows([["" if v != v else repr(v) for v in row] for row in rows])
        for name, content in self.raw.items():
            (folder / name).write_text(content, encoding="utf-8")
        return folder


@cache
def _swum(runs: int, seconds: float) -> Pool:
    rng = np.random.default_rng(5)
    made, entries = {}, []
    for number in range(runs):
        times = np.array([0.0, 0.3, 0.6]) * seconds
        steps = [
            {"t": float(t), "tail_amplitude": rng.uniform(0.25, 0.5),
             "tail_frequency": rng.uniform(1.0, 2.0), "tail_offset": rng.uniform(-0.4, 0.4),
             "block_displacement": rng.uniform(-0.012, 0.012)}
            for t in times.round(2)
        ]  # fmt: skip
        commands = schedule(steps)
        initial = InitialState(position=(0.0, 0.0, 0.5))
        swim = Simulator("zheng-2021-a").run(commands, seconds, rate_hz=25.0, initial=initial)
        columns = {"t": np.asarray(swim.time_s).copy()}
        columns |= {n: swim[n] + rng.normal(0.0, sd, len(swim)) for n, sd in NOISE.items()}
        columns |= dict(zip(COMMANDS, commands.at(swim.time_s).T.copy(), strict=True))
        made[f"r{number + 1}"] = columns
        entries.append(
            {"id": f"r{number + 1}", "file": f"r{number + 1}.csv", "start": "rest",
             "tail_phase": 0.0}
        )  # fmt: skip
    description = {
        "format": "robotic-fish-measurements/1",
        "name": "pool",
        "fish": "zheng-2021-a",
        "frame": "ned",
        "channels": dict(UNITS),
        "commands": dict(COMMAND_UNITS),
        "runs": entries,
    }
    return Pool(description, made)


def pool(runs: int = 3, seconds: float = 8.0) -> Pool:
    """A good dataset, to be changed as one likes."""
    return deepcopy(_swum(runs, seconds))
