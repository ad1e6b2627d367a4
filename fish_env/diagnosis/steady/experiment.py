"""Which condition to measure next: the one that best separates what the table leaves open.

As for runs over time, a rival is separated by the part of its difference that the coefficients,
held by the data so far and their priors, cannot follow (T-optimality: Atkinson and Fedorov, 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import numpy.typing as npt

from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.manoeuvres import MENU
from fish_env.diagnosis.next_experiment import Proposal, plausible_sizes, rivals_of, unfollowed
from fish_env.diagnosis.preconditions import Precondition
from fish_env.diagnosis.steady.attribution import Attribution
from fish_env.diagnosis.steady.fitting import SteadyFit, lines
from fish_env.diagnosis.steady.judging import noise_on
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.scatter import linear_changes
from fish_env.diagnosis.steady.table import Table
from fish_env.diagnosis.verdict import Verdict
from fish_env.effects.extended import PREFIX
from fish_env.identification.problem import Point

FloatArray = npt.NDArray[np.float64]
HOLD_S = 60.0
REPEATS = 4
STEP = 0.05
WORTH = 1.0
"""Squared distance, in noise units, below which no condition is worth the while."""


def propose(
    attribution: Attribution, verdict: Verdict, shown: Sequence[Precondition]
) -> Proposal | None:
    """A condition to hold and repeat, or a manoeuvre to record over time; None if all is clear."""
    fit = attribution.accepted.fit
    others = {e.causes: e.fit.point for e in attribution.rivals}
    rivals = rivals_of(verdict, others, shown, lambda name: plausible(fit, name))
    if not rivals:
        return None
    problem = fit.problem.with_table(candidates(fit.problem.table))
    distance = separation(fit, problem, list(rivals.values()))
    worth = np.log1p(REPEATS * distance).mean(axis=0)
    best = int(np.argmax(worth))
    names = tuple(rivals)
    if REPEATS * distance[:, best].max() < WORTH:
        return _over_time(names)
    row = dict(zip(COMMANDS, problem.table.commands[best].tolist(), strict=True))
    held = f"hold one condition, average over whole beats, {REPEATS} times"
    gained = float(REPEATS * distance[:, best].mean())
    return Proposal(held, ({"t": 0.0, **row}, {"t": HOLD_S, **row}), names, gained)


def _over_time(names: tuple[str, ...]) -> Proposal:
    """Averages will not do: runs recorded over time show what they hide."""
    manoeuvre = next(m for m in MENU if m.name == "burst and coast")
    name = f"record over time: {manoeuvre.name}"
    return Proposal(name, manoeuvre.schedule, names, 0.0)


def plausible(fit: SteadyFit, name: str) -> Point:
    """The present explanation with an effect at a plausible size."""
    sizes = plausible_sizes(fit.problem.known[name])
    values = {f"{PREFIX}{name}.{parameter}": size for parameter, size in sizes.items()}
    return Point(fit.point.z, {**fit.point.effects, **values})


def candidates(table: Table) -> Table:
    """Conditions within the commands of a table, and half as much again in frequency."""
    of = dict(zip(COMMANDS, table.commands.T, strict=True))
    amplitudes = np.linspace(of["tail_amplitude"].min(), of["tail_amplitude"].max(), 3)
    low, high = of["tail_frequency"].min(), of["tail_frequency"].max()
    frequencies = np.unique(np.round([0.75 * low, low, high, 1.5 * high], 3))
    largest = max(float(np.abs(of["tail_offset"]).max()), 0.2)
    offsets = (0.0, 0.5 * largest, largest)
    rows = [(o, a, f, 0.0, 0.0) for a, f, o in product(amplitudes, frequencies, offsets)]
    moved = of["block_displacement"]
    rows += [
        (0.0, amplitudes[-1], float(np.median(of["tail_frequency"])), shift, 0.0)
        for shift in (moved.min(), moved.max())
        if shift != 0.0
    ]
    commands = np.array([row for row in rows if row[2] > 0.0])
    count = len(commands)
    return replace(
        table,
        ids=tuple(str(i) for i in range(count)),
        conditions=tuple(str(i) for i in range(count)),
        commands=commands,
        condition_of=np.arange(count),
        values=np.zeros((count, len(table.observations))),
    )


def separation(fit: SteadyFit, problem: SteadyProblem, rivals: Sequence[Point]) -> FloatArray:
    """Squared distance of each rival under each condition, shape (rivals, C), in noise units."""
    orbits = problem.orbits([fit.point])
    base = problem.means(orbits)[0]
    usable = np.isfinite(base).all(axis=1)
    noise = noise_on(problem, fit)
    size = len(fit.problem.baseline)
    nudged = [replace(fit.point, z=fit.point.z + STEP * np.eye(size)[i]) for i in range(size)]
    slopes = linear_changes(problem, fit.point, orbits, nudged) / STEP
    others = problem.means(problem.orbits(rivals, orbits)) - base
    count, width = base.shape
    slopes, others = (
        np.nan_to_num(lines(problem, v, noise)).reshape(len(v), count, width)
        for v in (slopes, others)
    )
    information = fit.slopes[:, :size].T @ fit.slopes[:, :size] + 1e-9 * np.eye(size)
    found = [unfollowed(slopes[:, i].T, others[:, i].T, information) for i in range(count)]
    return np.where(usable, np.column_stack(found), 0.0)
