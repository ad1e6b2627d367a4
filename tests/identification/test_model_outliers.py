"""Outliers beside the prediction of the model: near jumps of commands and beside gaps too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification.model_outliers import without_model_outliers
from fish_env.identification.series import SeriesProblem
from fish_env.rigidbody.outliers import Outliers
from tests.identification.synthetic import PATHS, SENSOR_SD, Setup, simulate

SIZE, SHARE = 20.0, 0.01


def spoilt(data, share, rng):
    """The data with outliers of SIZE standard deviations, and where they are in each run."""
    runs, where = [], []
    for run in data.runs:
        seen, masks = {}, {}
        for name, values in run.channels.items():
            mask = rng.random(len(values)) < share
            mask[:20] = False
            masks[name] = mask
            size = SIZE * SENSOR_SD[name] * rng.choice([-1.0, 1.0], len(values))
            seen[name] = np.where(mask, values + size, values)
        runs.append(replace(run, channels=seen))
        where.append(masks)
    return replace(data, runs=tuple(runs)), where


def none_known(problem):
    masks = tuple(np.zeros(len(run.clock), bool) for run in problem.runs)
    return tuple(Outliers(name, "", masks, None, np.zeros(0)) for name in problem.channels)


def near_jumps(run):
    since = run.clock[:, None] - run.commands[0][None]
    return np.any((since >= -1e-9) & (since < 0.1), axis=1)


@pytest.fixture(scope="module")
def data():
    return simulate(Setup(runs=4, duration=16.0, missing=0.03))


def test_outliers_are_found_also_near_jumps_and_gaps(data):
    bad, where = spoilt(data, SHARE, np.random.default_rng(1))
    problem = SeriesProblem(bad, paths=PATHS)
    cleaned, found = without_model_outliers(problem, none_known(problem))
    there = {name: np.concatenate([masks[name] for masks in where]) for name in problem.channels}
    flagged = {one.channel: np.concatenate(one.flagged) for one in found}
    near = np.concatenate([near_jumps(run) for run in problem.runs])
    measured = np.concatenate([np.isfinite(run.measured) for run in problem.runs])
    hit = {n: there[n] & measured[:, i] for i, n in enumerate(problem.channels)}
    every = sum(int(mask.sum()) for mask in hit.values())
    right = sum(int((hit[n] & flagged[n]).sum()) for n in hit)
    at_jumps = sum(int((hit[n] & near).sum()) for n in hit)
    right_at_jumps = sum(int((hit[n] & near & flagged[n]).sum()) for n in hit)
    wrong = sum(int((flagged[n] & ~there[n]).sum()) for n in hit)
    assert right > 0.85 * every  # side by side they hide each other
    assert right_at_jumps > 0.6 * at_jumps > 5
    assert wrong < 0.02 * every
    gone = sum(int(np.isfinite(a.measured).sum() - np.isfinite(b.measured).sum())
               for a, b in zip(problem.runs, cleaned.runs, strict=True))  # fmt: skip
    assert gone == sum(one.count for one in found)


def test_clean_data_lose_nothing(data):
    problem = SeriesProblem(data, paths=PATHS)
    cleaned, found = without_model_outliers(problem, none_known(problem))
    assert sum(one.count for one in found) <= 1
    assert len(cleaned.runs) == len(problem.runs)


def test_what_a_model_misses_at_jumps_is_no_outlier(data):
    """A spike after every jump is motion that the model lacks: there are too many for sensors."""
    runs = []
    for run in data.runs:
        times = run.time_s - run.time_s[0]
        after = np.any(np.abs(times[:, None] - run.commands.times_s[None] - 0.04) < 0.01, axis=1)
        seen = {**run.channels, "r": run.channels["r"] + SIZE * SENSOR_SD["r"] * after}
        runs.append(replace(run, channels=seen))
    problem = SeriesProblem(replace(data, runs=tuple(runs)), paths=PATHS)
    _, found = without_model_outliers(problem, none_known(problem))
    assert sum(one.count for one in found) <= 1
