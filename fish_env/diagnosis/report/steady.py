"""Series of a table of steady motion, from what its diagnosis has in hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import SteadyDataset
from fish_env.diagnosis.report.series import SteadySeries
from fish_env.diagnosis.tables.gain import predictions
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import Table, table_of
from fish_env.inference.estimate.fit import Fit


def steady_series_from(
    dataset: SteadyDataset,
    problem: TableProblem,
    baseline: Fit,
    accepted: Fit,
    final_conditions: Sequence[str] = (),
) -> SteadySeries:
    """Measured and predicted averages of every condition, repeats taken together.

    Args:
        dataset: the measured table.
        problem: what was fitted of it.
        baseline: refitted baseline.
        accepted: accepted explanation; the same object where nothing was added.
        final_conditions: names of the held-out ones, as the gain has them.
    """
    table = table_of(dataset)
    whole = problem.with_table(table)

    def named(values: FloatArray) -> dict[str, FloatArray]:
        return dict(zip(table.observations, values.T, strict=True))

    return SteadySeries(
        table.conditions,
        table.commands,
        named(_means(table)),
        named(predictions(whole, baseline)),
        {} if accepted is baseline else named(predictions(whole, accepted)),
        np.isin(table.conditions, list(final_conditions)),
    )


def _means(table: Table) -> FloatArray:
    """Measured means over repeats, shape (C, K), NaN where nothing is measured."""
    totals = np.zeros(table.counts.shape)
    np.add.at(totals, table.condition_of, np.where(table.present, table.values, 0.0))
    return np.where(table.counts > 0, totals / np.maximum(table.counts, 1.0), np.nan)
