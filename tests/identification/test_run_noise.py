"""Runs with noisier sensors: told without a model, and given less weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.identification.noise import fitted_noise
from fish_env.identification.run_noise import noise_scales, with_noisy_runs_told
from fish_env.identification.series import SeriesProblem
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, SENSOR_SD, Setup, simulate

CAMERA = ("x", "y", "yaw")


def noisier(dataset, sizes):
    """More noise in some runs: its standard deviation over the usual one by run."""
    rng = np.random.default_rng(1)
    runs = []
    for run in dataset.runs:
        more = np.sqrt(sizes.get(run.id, 1.0) ** 2 - 1.0)
        noise = {n: more * SENSOR_SD[n] * rng.standard_normal(len(run.time_s)) for n in CAMERA}
        runs.append(replace(run, channels={n: run.channels[n] + noise[n] for n in CAMERA}))
    return replace(dataset, runs=tuple(runs))


@pytest.fixture(scope="module")
def plain():
    return simulate(Setup(runs=8, duration=8.0, channels=CAMERA))


def test_runs_of_one_noise_are_alike(plain):
    assert all((scale == 1.0).all() for scale in noise_scales(plain, CAMERA).values())
    assert with_noisy_runs_told(plain) is plain


def test_a_noisy_run_is_told_by_its_size_with_gaps_and_an_outlier(plain):
    loud = plain.ids[3]
    dataset = noisier(plain, {loud: 3.0})
    holes = np.random.default_rng(2).choice(len(dataset.runs[3].time_s), 5, replace=False)
    spoilt = {n: values.copy() for n, values in dataset.runs[3].channels.items()}
    for values in spoilt.values():
        values[holes[:4]], values[holes[4:]] = np.nan, values[holes[4:]] + 1.0
    runs = list(dataset.runs)
    runs[3] = replace(runs[3], channels=spoilt)
    dataset = replace(dataset, runs=tuple(runs))
    scales = noise_scales(dataset, CAMERA)
    assert scales[loud] == pytest.approx(3.0, rel=0.25)
    assert max(scale.max() for id, scale in scales.items() if id != loud) < 1.25
    (note,) = with_noisy_runs_told(dataset).notes[len(dataset.notes) :]
    assert loud in note
    assert not any(id in note for id in dataset.ids if id != loud)


def test_samples_too_few_for_a_beat_tell_no_noise(plain):
    """The motion that their differences still hold would pass for noise."""
    dataset = noisier(plain, {plain.ids[3]: 3.0})
    slow = [
        replace(
            run,
            time_s=run.time_s[::5],
            channels={n: values[::5] for n, values in run.channels.items()},
        )
        for run in dataset.runs
    ]
    scales = noise_scales(replace(dataset, runs=tuple(slow)), CAMERA)
    assert all((scale == 1.0).all() for scale in scales.values())


def test_the_noise_of_a_run_is_not_taken_for_a_disturbance(plain):
    """Of all runs together it would be noise of the water, and the quiet runs would count less."""
    dataset = noisier(plain, dict.fromkeys(plain.ids[::2], 4.0))
    point = Point(np.zeros(len(PATHS)), {})
    told = SeriesProblem(dataset, paths=PATHS)
    untold = told.with_runs([replace(run, noise_scale=np.ones(1)) for run in told.runs])
    quiet, loud = told.runs[1], told.runs[0]
    assert (quiet.noise_scale == 1.0).all()
    assert loud.noise_scale == pytest.approx(4.0, rel=0.25)

    def scatter(problem):
        noise = fitted_noise(
            problem, range(problem.run_count), point, problem.default_noise(),
            problem.largest_sensor_sd,
        )  # fmt: skip
        found = problem.filtered(point, noise)
        return [float(np.sqrt(np.nanmean(f.innovations[10:] ** 2))) for f in found]

    assert scatter(told) == pytest.approx(np.ones(8), abs=0.2)
    assert min(scatter(untold)[1::2]) < 0.6
