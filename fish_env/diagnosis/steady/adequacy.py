"""Does an explanation reach the floor that the repeats set? And if not, what is missing where.

Two tests share the error rate. The first compares what the conditions miss with what repeats of
one condition differ by. The second adds a force or moment that depends on the commands in one of
some simple ways, and asks whether a refit wants it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import fdtrc

from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.causes import Cause
from fish_env.diagnosis.generic_forces import DIRECTIONS
from fish_env.diagnosis.steady.fitting import SteadyFit, lines
from fish_env.diagnosis.steady.scatter import response
from fish_env.diagnosis.steady.screening import Projector, Signal, null_threshold

FloatArray = npt.NDArray[np.float64]
LEVEL = 0.005
"""Of each of the two tests."""
FEWEST_REPEATS = 6


@dataclass(frozen=True)
class Misfit:
    """A force or moment that the data ask for.

    Attributes:
        function: what it depends on.
        direction: which force or moment.
        log_p: of this one test.
        size: root mean square over the conditions, N or N m.
        coefficient: of the function, whose own root mean square is one.
    """

    function: str
    direction: str
    log_p: float
    size: float
    coefficient: float


@dataclass(frozen=True)
class Adequacy:
    """Result of the tests.

    Attributes:
        reached: neither test objects.
        ratio: mean square that conditions miss over that of repeats; None with too few repeats.
        p_value: of that ratio.
        threshold: log p-value for the wrenches.
        misfits: wrenches asked for most, strongest first.
        worst: condition, observation and error in noise standard deviations, largest first.
    """

    reached: bool
    ratio: float | None
    p_value: float | None
    threshold: float
    misfits: tuple[Misfit, ...]
    worst: tuple[tuple[str, str, float], ...]


def adequacy(fit: SteadyFit, rng: np.random.Generator) -> Adequacy:
    """Test a fit."""
    ratio, p_value = lack_of_fit(fit)
    threshold, misfits = wrenches(fit, rng)
    asked = bool(misfits) and misfits[0].log_p < threshold
    short = p_value is not None and p_value < LEVEL
    return Adequacy(not (asked or short), ratio, p_value, threshold, misfits, worst_of(fit))


def lack_of_fit(fit: SteadyFit) -> tuple[float | None, float | None]:
    """Mean square of what conditions miss over that of repeats, and its p-value."""
    table = fit.problem.table
    if table.repeats < FEWEST_REPEATS:
        return None, None
    row, column = np.nonzero(table.present)
    cell = table.condition_of[row] * len(table.observations) + column
    seen = fit.residuals[: len(row)]
    size = len(table.conditions) * len(table.observations)
    counts = np.bincount(cell, minlength=size)
    mean = np.bincount(cell, seen, size) / np.maximum(counts, 1)
    held = fit.residuals[len(row) :]
    between = float(np.sum(counts * mean**2) + held @ held)
    within = float(np.sum((seen - mean[cell]) ** 2))
    freedom = int((counts > 0).sum()) + len(held) - fit.slopes.shape[1]
    if freedom < 1:
        return None, None
    ratio = (between / freedom) / (within / table.repeats)
    return ratio, float(fdtrc(freedom, table.repeats, ratio))


def wrenches(fit: SteadyFit, rng: np.random.Generator) -> tuple[float, tuple[Misfit, ...]]:
    """What forces and moments a refit asks for."""
    problem, projector = fit.problem, Projector(fit)
    held = response(problem, fit.point, fit.orbits).held()
    signals: list[Signal] = []
    found = []
    for name, values in functions(problem.table.commands).items():
        for i, direction in enumerate(DIRECTIONS):
            unit = 1e-3 if i < 3 else 1e-5
            change = lines(problem, unit * held[:, :, i] * values[:, None], fit.scatter)
            column = np.zeros((len(fit.residuals), 1))
            column[: len(change), 0] = change
            signal = projector.signal(Cause("generic"), 0, column, False)
            if signal is not None:
                signals.append(signal)
                size = float(signal.score[0] / signal.projected[0, 0]) * unit
                found.append(Misfit(name, direction, signal.log_p, abs(size), size))
    threshold = null_threshold(signals, projector.freedom, rng, LEVEL)
    found.sort(key=lambda m: m.log_p)
    return threshold, tuple(found[:8])


def functions(commands: FloatArray) -> dict[str, FloatArray]:
    """Functions of the commands, each (C,), with a root mean square of one."""
    of = dict(zip(COMMANDS, commands.T, strict=True))
    offset, amplitude, frequency = (of[f"tail_{n}"] for n in ("offset", "amplitude", "frequency"))
    beat = amplitude * frequency
    plain = {"constant": np.ones_like(offset), "beat speed^2": beat**2}
    varied = {
        "offset": offset,
        "|offset|": np.abs(offset),
        "offset^2": offset**2,
        "amplitude": amplitude,
        "frequency": frequency,
        "offset beat^2": offset * beat**2,
        "|offset| beat^2": np.abs(offset) * beat**2,
        "block": of["block_displacement"],
        "bracket": of["block_angle"],
    }
    plain |= {name: v for name, v in varied.items() if np.ptp(v) > 1e-9}
    return {name: v / np.sqrt(np.mean(v**2)) for name, v in plain.items() if np.mean(v**2) > 1e-18}


def worst_of(fit: SteadyFit) -> tuple[tuple[str, str, float], ...]:
    """Largest errors of averages over repeats."""
    table = fit.problem.table
    total = np.zeros(fit.means.shape)
    error = np.where(table.present, table.values - fit.means[table.condition_of], 0.0)
    np.add.at(total, table.condition_of, error)
    counts = table.counts
    sizes = total / np.sqrt(np.maximum(counts, 1.0)) / fit.scatter.sd
    order = np.argsort(-np.abs(sizes), axis=None)[:5]
    return tuple(
        (table.conditions[i], table.observations[k], float(sizes[i, k]))
        for i, k in zip(*np.unravel_index(order, sizes.shape), strict=True)
    )
