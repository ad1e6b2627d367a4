"""How well a dataset agrees with itself and with its commands, in one number per comparison."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from fish_env.data.schema import CommandSteps, Dataset, Run
from fish_env.diagnosis.inputs.orders import Stroke, explained, strokes_under, windows_of
from fish_env.diagnosis.inputs.responses import STEP_S, Simulated, responses, simulate
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.recorded import recorded
from fish_env.params.schema import FishParams
from fish_env.rigidbody.comparisons import Comparison
from fish_env.rigidbody.gridded import GridRun, gridded
from fish_env.rigidbody.links import links
from fish_env.simulator import Simulator

BEAT = "beat against commands"


@dataclass(frozen=True, eq=False)
class Weighed:
    """What a reading of a dataset is worth.

    Attributes:
        comparisons: of the channels with each other and with the commands, by name.
        beats: by run, the share of the sway in each window that the commanded beat leaves.
    """

    comparisons: Mapping[str, Comparison]
    beats: Mapping[str, list[float]]

    @property
    def disagreement(self) -> dict[str, float]:
        """Of each comparison: 0 the same, 1 unrelated, 2 opposite."""
        every = {name: c.disagreement for name, c in self.comparisons.items()}
        beats = [left for run in self.beats.values() for left in run]
        return {**every, BEAT: float(np.mean(beats))} if beats else every

    @property
    def windows(self) -> dict[str, int]:
        """Number of windows of each comparison."""
        every = {name: c.windows for name, c in self.comparisons.items()}
        return {**every, BEAT: sum(map(len, self.beats.values()))}

    def gain(self, other: Weighed) -> float:
        """Log likelihood of another reading over this one, by what both can be judged by.

        Errors are taken to be normal with a size of their own in each comparison.
        """
        mine, theirs, windows = self.disagreement, other.disagreement, self.windows
        least = CHECKS.best_disagreement
        return sum(
            0.5
            * (1.0 if name == BEAT else CHECKS.comparison_weight)
            * windows[name]
            * float(np.log((mine[name] + least) / (theirs[name] + least)))
            for name in mine
            if name in theirs
        )

    def of_runs(self, runs: Collection[str]) -> Weighed:
        """The beats of some runs alone."""
        return Weighed({}, {run: left for run, left in self.beats.items() if run in runs})

    def clearest(self, other: Weighed) -> tuple[str, float, float]:
        """The comparison that another reading improves most, without and with it."""
        mine, theirs = self.disagreement, other.disagreement
        shared = sorted(mine.keys() & theirs.keys())
        best = max(shared, key=lambda name: mine[name] - theirs[name], default="")
        return (best, mine[best], theirs[best]) if best else ("", 1.0, 1.0)


class Scales:
    """Weighs readings of one dataset against the nominal fish.

    Args:
        fish: the nominal fish.
    """

    def __init__(self, fish: FishParams) -> None:
        self.simulator = Simulator(fish, dt=STEP_S)
        self._known: dict[tuple[object, ...], tuple[CommandSteps, Simulated | None]] = {}

    def weigh(self, dataset: Dataset) -> Weighed:
        """Every comparison that the channels of a dataset allow."""
        runs = gridded(recorded(dataset))
        swum = [self._swum(grid, run) for grid, run in zip(runs, dataset.runs, strict=True)]
        found = [*links(runs), *responses(runs, swum)]
        strokes = strokes_under(runs, [run.commands for run in dataset.runs])
        beats = {run: left_by(stroke) for run, stroke in strokes.items()}
        return Weighed(
            {c.name: c for c in found}, {run: left for run, left in beats.items() if left}
        )

    def _swum(self, grid: GridRun, run: Run) -> Simulated | None:
        """The nominal fish under a run's commands; known where only channels are read otherwise."""
        steps = run.commands
        key = (id(steps), grid.begin_s, grid.step_s, grid.size, run.start)
        if key not in self._known:
            # The commands are kept, so that nothing else gets their identity.
            swum = simulate(self.simulator, grid, steps, run.start == "rest")
            self._known[key] = steps, swum
        return self._known[key][1]


def left_by(stroke: Stroke) -> list[float]:
    """Share of the sway in each window that the commanded stroke leaves unexplained."""
    left: list[float] = (1.0 - explained(windows_of([stroke], 1.0), np.ones(1))[:, 0]).tolist()
    return left
