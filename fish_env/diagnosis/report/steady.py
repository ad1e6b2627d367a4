"""Series of a table of steady motion, from what its diagnosis has in hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fish_env.data.schema import SteadyDataset
from fish_env.diagnosis.report.series import SteadySeries
from fish_env.diagnosis.steady.fitting import SteadyFit
from fish_env.diagnosis.steady.judging import predictions
from fish_env.diagnosis.steady.table import Table, table_of

FloatArray = npt.NDArray[np.float64]


def steady_series_from(
    dataset: SteadyDataset,
    baseline: SteadyFit,
    accepted: SteadyFit,
    final_conditions: Sequence[str] = (),
) -> SteadySeries:
    """Measured and predicted averages of every condition, repeats taken together.

    Args:
        dataset: the measured table.
        baseline: refitted baseline.
        accepted: accepted explanation; the same object where nothing was added.
        final_conditions: names of those kept for judging, as the gain has them.
    """
    table = table_of(dataset)
    whole = baseline.problem.with_table(table)

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
