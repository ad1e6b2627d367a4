"""How much of the misfit each hidden thing makes, by adding it and by leaving it out.

The misfit of a simulation is the mean square difference of its channels from the truth, without
noise, in units of the noise. The simulation starts anew from the true state every few seconds:
over whole runs a small error of the heading would decide about everything. The share of a hidden
thing is the mean of two: how much less the misfit is where the thing is added to the nominal
simulation, and how much more where it is left out of the truth, both over the misfit of the nominal
simulation. Shares need not add up to one.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tests.hidden.realistic.catalogue import STOCHASTIC
from tests.hidden.realistic.sensors import Channels, Motion, sampled, systematic
from tests.hidden.realistic.swimming import Case, Drawn, clocks, motion_key, swimmer
from tests.hidden.servo import LIMIT, PHASE, PLAY
from tests.hidden.simulate import Swim

ALL = "all"
STEPS = (0.012, 0.006, 0.003)
"""s. Grids of motions that are only compared with each other. The first takes a third of the time
of the log's grid. A short lag of the servo makes the motion diverge on it (8 ms did): then the next
is taken."""
WINDOW = 3.0
"""s, true time. How long a simulation runs on before it starts anew from the truth."""

BENT = slice(37, 39)
"""State of a body that bends."""


@dataclass(frozen=True)
class Mark:
    """The true robot at the begin of a window: by the clock of the measurements, s."""

    stamp: float
    state: np.ndarray
    drive: np.ndarray
    phase: float


@dataclass(frozen=True)
class Windows:
    """The runs of a case, with simulations that start anew in every window.

    Attributes:
        case: fish and hidden things.
        runs: the runs as drawn.
        marks: the truth at the begin of each window, by run.
        step: grid of the motions, s.
        motions: what was swum already, by run and pieces.
    """

    case: Case
    runs: Sequence[Drawn]
    step: float
    marks: list[list[Mark]]
    motions: dict[tuple[int, frozenset[str]], Motion]

    @classmethod
    def of(cls, case: Case, runs: Sequence[Drawn], step: float) -> Windows:
        """Swims the truth once, and marks it."""
        marks = [marks_of(case, drawn, i, step) for i, drawn in enumerate(runs)]
        return cls(case, runs, step, marks, {})

    def channels(self, run: int, present: Collection[str]) -> Channels:
        """The log of a run without noise, in which some of the pieces act."""
        drawn, values = self.runs[run], self.case.values(run, present)
        key = (run, motion_key(self.case, present))
        if key not in self.motions:
            self.motions[key] = self._swim(run, present)
        when = np.maximum(drawn.stamps * clocks(values)[1], 0.0)
        return sampled(self.motions[key], systematic(self.motions[key], values), when, values)

    def _swim(self, run: int, present: Collection[str]) -> Motion:
        fish, times = swimmer(self.case, self.runs[run], run, present, self.step)
        scale = clocks(self.case.values(run, present))[1]
        marks = self.marks[run]
        ends = [mark.stamp * scale for mark in marks[1:]] + [float(times[-1]) + self.step]
        states = []
        for mark, end in zip(marks, ends, strict=True):
            begin = mark.stamp * scale
            start_anew(fish, mark, begin)
            inside = times[(times >= begin) & (times < end)]
            states.append(fish.run(end, inside))
        return Motion(times, np.concatenate(states))


def start_anew(fish: Swim, mark: Mark, begin: float) -> None:
    """Puts a fish where the truth is, with nothing left of effects that it has not."""
    fish.time = begin
    fish.state[:], fish.drive[:] = mark.state, mark.drive
    # Whether limit and play hold the tail is planned anew in every step, where there are any.
    for memory in (LIMIT, PLAY):
        fish.drive[memory + 1 : memory + 4] = 0.0
    if "body_flexibility" not in fish.effects:
        fish.state[BENT] = 0.0
    fish.table[:, PHASE] += mark.phase - fish.phase_at(begin)


def marks_of(case: Case, drawn: Drawn, run: int, step: float) -> list[Mark]:
    """The truth at the begin of each window of a run."""
    fish, times = swimmer(case, drawn, run, case.names, step)
    scale = clocks(case.values(run, case.names))[1]
    marks = []
    for begin in np.arange(0.0, float(times[-1]) - 0.5 * WINDOW, WINDOW):
        if begin > 0.0:
            fish.run(float(begin), np.zeros(0))
        marks.append(
            Mark(begin / scale, fish.state.copy(), fish.drive.copy(), fish.phase_at(begin))
        )
    return marks


def budget(
    case: Case, runs: Sequence[Drawn], noise: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Share of the misfit by hidden thing, each by channel and over all channels.

    Args:
        case: fish and hidden things.
        runs: the runs as drawn.
        noise: one-sigma noise of the measured channels.
    """
    for step in STEPS:
        shares = shares_of(Windows.of(case, runs, step), noise)
        if all(np.isfinite(list(of_piece.values())).all() for of_piece in shares.values()):
            return shares
    raise RuntimeError("the motion diverges on every grid")


def shares_of(windows: Windows, noise: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """The shares on one grid; not a number where a motion diverges on it."""
    runs, every = windows.runs, windows.case.names
    truth = [windows.channels(run, every) for run in range(len(runs))]

    def misfit(present: Collection[str]) -> dict[str, float]:
        seen = [windows.channels(run, present) for run in range(len(runs))]
        return mean_squares(seen, truth, noise)

    worst = misfit(())
    shares = {}
    for name in sorted(every - set(STOCHASTIC)):
        alone, without = misfit({name}), misfit(every - {name})
        shares[name] = {
            channel: 0.5 * (worst[channel] - alone[channel] + without[channel]) / worst[channel]
            for channel in worst
        }
    return shares


def mean_squares(
    seen: Sequence[Channels], truth: Sequence[Channels], noise: Mapping[str, float]
) -> dict[str, float]:
    """Mean square differences in units of the noise, by channel, and their mean."""
    by_channel = {
        name: float(
            np.mean([np.mean((a[name] - b[name]) ** 2) for a, b in zip(seen, truth, strict=True)])
            / sd**2
        )
        for name, sd in noise.items()
    }
    return by_channel | {ALL: float(np.mean(list(by_channel.values())))}
