"""Beats of single runs are found where they differ, and are none where all runs share one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.identification.own_beats import CLEARLY, OwnBeats, own_beats, with_own_beats
from fish_env.identification.runs import FREQUENCY
from fish_env.identification.series import SeriesProblem
from tests.identification.synthetic import Setup, simulate

SETUP = Setup(runs=5, duration=24.0)


def told(dataset, ratios):
    """The dataset with commands that say less than its tails did, by run."""
    runs = []
    for run, ratio in zip(dataset.runs, ratios, strict=True):
        values = run.commands.values.copy()
        values[:, FREQUENCY] /= ratio
        runs.append(replace(run, commands=CommandSteps(run.commands.times_s, values)))
    return replace(dataset, runs=tuple(runs))


@pytest.fixture(scope="module")
def dataset():
    return simulate(SETUP)


def test_runs_that_beat_alike_have_no_beat_of_their_own(dataset):
    assert own_beats(SeriesProblem(dataset)).own == {}
    quicker = own_beats(SeriesProblem(told(dataset, [1.01] * 5)))
    assert quicker.own == {}
    assert quicker.common == pytest.approx(1.01, abs=1e-3)


def test_each_runs_own_beat_is_found_beside_a_common_one(dataset):
    ratios = np.array([1.0, 1.008, 0.99, 1.0, 1.0])
    problem = SeriesProblem(told(dataset, 0.97 * ratios))
    beats = own_beats(problem)
    assert beats.common == pytest.approx(0.97, abs=1e-3)
    found = beats.own
    assert set(found) == {"r1", "r2"}
    assert found["r1"] == pytest.approx(1.008, abs=1e-3)
    assert found["r2"] == pytest.approx(0.99, abs=1e-3)


def test_the_commands_are_those_that_the_tail_followed(dataset):
    problem = SeriesProblem(told(dataset, [1.0, 1.008, 1.0, 1.0, 1.0]))
    right = with_own_beats(problem, OwnBeats(1.0, {"r1": 1.008}))
    expected = SeriesProblem(dataset).runs[1].command_values
    assert np.allclose(right.runs[1].command_values, expected)
    assert right.runs[1].own_beat == 1.008
    assert with_own_beats(problem, OwnBeats()).runs is problem.runs


def test_a_run_whose_own_beat_takes_little_away_keeps_the_common_one():
    """Where the model misses something, as it does before causes are known."""
    wrong = simulate(replace(SETUP, changes={"tail.lift.c1": 6.5}))
    beats = own_beats(SeriesProblem(told(wrong, [1.0, 1.012, 0.992, 1.0, 1.002])))
    assert set(beats.own) == {"r1", "r2"}
    assert 0.0 < beats.gains["r4"] < CLEARLY
