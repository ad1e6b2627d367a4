"""How the nominal fish answers its commands, against how the measured one did.

A tail that is offset turns the fish, a block that is moved pitches it, one that is turned rolls it.
However wrong the coefficients are, the nominal simulation does so to the same side. Averages over
about a beat are compared, so the tail's phase plays no part.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps
from fish_env.data.units import unwrap_angle
from fish_env.diagnosis.policy import CHECKS
from fish_env.errors import RoboticFishError
from fish_env.rigidbody.comparisons import Comparison, compared
from fish_env.rigidbody.gridded import GridRun, averaged, grown
from fish_env.rigidbody.interpolation import NORMAL_MEDIAN
from fish_env.simulator import Simulator

BEAT_S = 1.0
"""s over which motions are averaged: about a beat."""
DEPTH_S = 2.0
"""s over which a change of depth is taken."""
STEP_S = 0.02
"""s. Physics step: only averages are wanted."""
AGAINST = "against commands"
Simulated = dict[str, FloatArray]


def simulate(
    simulator: Simulator, grid: GridRun, steps: CommandSteps, from_rest: bool
) -> Simulated | None:
    """Channels of the nominal fish, which begins level, at rest, at the origin.

    Args:
        simulator: of that fish.
        grid: times at which they are wanted.
        steps: its commands.
        from_rest: whether the measured fish began like this.

    Returns:
        The channels by name, NaN where the start still matters; None if the simulation diverges.
    """
    times = grid.begin_s + grid.since_s
    try:
        with warnings.catch_warnings():
            # Other readings ask the crank for what it cannot reach.
            warnings.simplefilter("ignore", UserWarning)
            swum = simulator.run(steps, sample_times_s=times)
    except RoboticFishError:
        return None
    seen = {name: np.asarray(values) for name, values in swum.channels.items()}
    seen |= {name: unwrap_angle(seen[name]) for name in ("roll", "yaw")}
    if not from_rest:
        late = grid.since_s < CHECKS.compared_from_s
        seen = {name: np.where(late, np.nan, values) for name, values in seen.items()}
    return seen


def responses(runs: Sequence[GridRun], swum: Sequence[Simulated | None]) -> list[Comparison]:
    """Every response that the channels show.

    Args:
        runs: as measured.
        swum: as the nominal fish swims them; None where it cannot.
    """
    pairs = [(run, s) for run, s in zip(runs, swum, strict=True) if s is not None]
    measured = runs[0].channels
    found = []
    for name in ("roll", "pitch", "yaw"):
        if name in measured:
            found.append(_compared(pairs, f"change of {name}", (name,), _change, BEAT_S))
    for name in ("roll", "pitch", "u", "v", "w", "p", "q", "r"):
        if name in measured:
            # Only the speed ahead has a mean that no trim or bias makes.
            found.append(_compared(pairs, name, (name,), _mean, BEAT_S, centred=name != "u"))
    if {"x", "y"} <= measured.keys():
        found.append(_compared(pairs, "speed", ("x", "y"), _speed, BEAT_S))
    if "z" in measured:
        found.append(_compared(pairs, "z", ("z",), _change, DEPTH_S, centred=True))
    return [comparison for comparison in found if comparison is not None]


Take = Callable[[Sequence[FloatArray], int], FloatArray]


def _compared(
    pairs: Sequence[tuple[GridRun, Simulated]],
    name: str,
    channels: tuple[str, ...],
    take: Take,
    seconds: float,
    centred: bool = False,
) -> Comparison | None:
    parts = []
    for run, s in pairs:
        stride = run.steps(seconds)
        measured, simulated = (take([of[c] for c in channels], stride) for of in (run.channels, s))
        parts.append((run, measured, simulated, stride))
    return compared(f"{name} {AGAINST}", channels, parts, centred)


def _change(columns: Sequence[FloatArray], stride: int) -> FloatArray:
    return grown(columns[0], stride)


def _mean(columns: Sequence[FloatArray], stride: int) -> FloatArray:
    return averaged(columns[0], stride)


def _speed(columns: Sequence[FloatArray], stride: int) -> FloatArray:
    """Way in the time of a stride; NaN where noise makes as long a one.

    A way has no sign, so the noise of positions does not cancel in it: positions that are nothing
    but noise would look like a fast fish.
    """
    way: FloatArray = np.hypot(*(grown(column, stride) for column in columns))
    noise = float(np.linalg.norm([_noise(column) for column in columns]))
    # The way between two positions with this noise is Rayleigh distributed.
    farthest = noise * np.sqrt(-2.0 * np.log(CHECKS.way_by_noise_level))
    return np.where(way > farthest, way, np.nan)


def _noise(column: FloatArray) -> float:
    """Standard deviation of white noise in a column, from its second differences."""
    bends = np.abs(np.diff(column, 2))
    bends = bends[np.isfinite(bends)]
    return float(np.median(bends)) / (NORMAL_MEDIAN * np.sqrt(6.0)) if len(bends) else 0.0
