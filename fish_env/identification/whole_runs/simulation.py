"""Simulations of whole runs from states of their own, many points at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.filtering import Pushes
from fish_env.identification.open_loop import without_feedback
from fish_env.identification.series import SeriesProblem
from fish_env.identification.whole_runs.own_numbers import OwnNumbers
from fish_env.inference.hypotheses import EffectParameterId


def simulation_errors(
    series: SeriesProblem,
    z: FloatArray,
    effects: Mapping[EffectParameterId, FloatArray],
    kinds: Sequence[OwnNumbers],
    own: Sequence[FloatArray],
    pace: EffectParameterId,
    pushes: Pushes | None = None,
) -> list[FloatArray]:
    """Measured less simulated (N, T, C) of each run, SI, zero where nothing was measured.

    Args:
        series: the runs and the model.
        z: (n, N) coefficients in units of their prior.
        effects: effect parameter -> (N,).
        kinds: what the own numbers of each run are.
        own: of each run, (K, N).
        pace: effect parameter that multiplies the commanded tail frequency; a run's own pace
            multiplies it.
        pushes: a prescribed wrench for each point.
    """
    count = z.shape[1]
    scale = series.neutral([pace.effect])[pace]
    values = {pace: np.full(count, scale), **effects}
    records, sensors = series.lanes(z, values)
    judge = series.filter_for(values)
    row = judge.kernels.parameter_names.index(f"{pace.effect}.{pace.name}")
    lanes, starts = [], []
    for run, kind, mine in zip(series.runs, kinds, own, strict=True):
        record = np.repeat(records, count, axis=1) if records.shape[1] == 1 else records.copy()
        record[row] *= kind.pace(mine)
        lanes.append(np.ascontiguousarray(record))
        starts.append(kind.states(run, mine))
    still = [without_feedback(run) for run in series.runs]
    noise = series.default_noise()
    rows = judge.innovations(lanes, sensors, noise, still, pushes, starts=starts)
    edges = np.cumsum([run.measured.size for run in series.runs])[:-1]
    pairs = zip(series.runs, np.split(rows, edges, axis=1), strict=True)
    return [part.reshape(count, *run.measured.shape) for run, part in pairs]
