"""Which condition to measure next: the one that best separates what the table leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.manoeuvres import MENU
from fish_env.diagnosis.next_experiment import (
    Proposal,
    changes_on,
    information_of,
    plausible,
    rivals_of,
    unfollowed,
)
from fish_env.diagnosis.policy import CHECKS
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import Table
from fish_env.inference.attribution import Attribution
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.preconditions import Precondition
from fish_env.inference.problem import Point
from fish_env.inference.verdict import Verdict

HOLD_S = 60.0
ORDINARY_AMPLITUDE, ORDINARY_FREQUENCIES = 0.35, (1.0, 2.0)
"""rad and Hz, of a tail that the table's commands leave still."""


def propose(
    problem: TableProblem,
    attribution: Attribution,
    verdict: Verdict,
    shown: Sequence[Precondition],
) -> Proposal | None:
    """A condition to hold and repeat, or a manoeuvre to record over time; None if all is clear.

    Args:
        problem: what was fitted.
        attribution: what was found.
        verdict: the answer.
        shown: what the table could show.
    """
    fit = attribution.accepted.fit
    others = {e.causes: e.fit.point for e in attribution.rivals}
    rivals = rivals_of(verdict, others, shown, lambda name: plausible(fit, name))
    if not rivals:
        return None
    names = tuple(rivals)
    there = steady_only(problem.with_table(candidates(problem.table)), fit)
    if there is None:
        return _over_time(names)
    repeats = CHECKS.held_repeats
    distance = repeats * separation(fit, there, list(rivals.values()))
    best = int(np.argmax(np.log1p(distance).mean(axis=0)))
    if distance[:, best].max() < CHECKS.least_separation:
        return _over_time(names)
    row = dict(zip(COMMANDS, there.table.commands[best].tolist(), strict=True))
    held = f"hold one condition, average over whole beats, {repeats} times"
    gained = float(distance[:, best].mean())
    return Proposal(held, ({"t": 0.0, **row}, {"t": HOLD_S, **row}), names, gained)


def _over_time(names: tuple[str, ...]) -> Proposal:
    """Averages will not do: runs recorded over time show what they hide."""
    manoeuvre = next(m for m in MENU if m.name == "burst and coast")
    name = f"record over time: {manoeuvre.name}"
    return Proposal(name, manoeuvre.schedule, names, 0.0)


def candidates(table: Table) -> Table:
    """Conditions within the commands of a table, and half as much again in frequency.

    Where the tail never beats they are those of an ordinary beat.
    """
    of = dict(zip(COMMANDS, table.commands.T, strict=True))
    beats = of["tail_amplitude"] * of["tail_frequency"] > 0.0
    smallest, widest = of["tail_amplitude"].min(), of["tail_amplitude"].max()
    low, high = of["tail_frequency"].min(), of["tail_frequency"].max()
    usual = float(np.median(of["tail_frequency"]))
    if not beats.any():
        widest, (low, high) = ORDINARY_AMPLITUDE, ORDINARY_FREQUENCIES
        usual = high
    amplitudes = np.linspace(smallest, widest, 3)
    frequencies = np.unique(np.round([0.75 * low, low, high, 1.5 * high], 3))
    largest = max(float(np.abs(of["tail_offset"]).max()), 0.2)
    offsets = (0.0, 0.5 * largest, largest)
    rows = [(o, a, f, 0.0, 0.0) for a, f, o in product(amplitudes, frequencies, offsets)]
    moved = of["block_displacement"]
    rows += [
        (0.0, amplitudes[-1], usual, shift, 0.0)
        for shift in (moved.min(), moved.max())
        if shift != 0.0
    ]
    commands = np.array([row for row in rows if row[2] > 0.0]).reshape(-1, len(COMMANDS))
    count = len(commands)
    return replace(
        table,
        ids=tuple(str(i) for i in range(count)),
        conditions=tuple(str(i) for i in range(count)),
        commands=commands,
        condition_of=np.arange(count),
        values=np.zeros((count, len(table.observations))),
    )


def steady_only(problem: TableProblem, fit: Fit) -> TableProblem | None:
    """The problem with the conditions that are steady by the present explanation, if any is."""
    if not problem.run_count:
        return None
    found = np.flatnonzero(problem.orbits(fit.point).found)
    return problem.on(found) if len(found) else None


def separation(fit: Fit, problem: TableProblem, rivals: Sequence[Point]) -> FloatArray:
    """Squared distance of each rival under each condition, shape (rivals, C), in noise units."""
    slopes, others = (
        np.nan_to_num(v) for v in changes_on(problem, fit, problem.noise_of(fit), rivals)
    )
    information, (condition, _) = information_of(fit), problem.groups()
    each = [condition == i for i in range(problem.run_count)]
    return np.column_stack([unfollowed(slopes[own], others[own], information) for own in each])
