"""Beats and sags of single runs are found where they differ, and none where all share one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Run
from fish_env.identification.own_beats import OwnBeats, own_beats, with_own_beats
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import FREQUENCY
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tail_drive import RATE, SCALE, TailDrive, tail_drive
from fish_env.identification.variation import BEAT, SAG
from fish_env.inference.budget import error_budget
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.identification.synthetic import FISH, PATHS, SENSOR_SD, Setup, simulate

SETUP = Setup(runs=5, duration=24.0)


def told(dataset, ratios):
    """The dataset with commands that say less than its tails did, by run."""
    runs = []
    for run, ratio in zip(dataset.runs, ratios, strict=True):
        values = run.commands.values.copy()
        values[:, FREQUENCY] /= ratio
        runs.append(replace(run, commands=CommandSteps(run.commands.times_s, values)))
    return replace(dataset, runs=tuple(runs))


def sagging(dataset, rates):
    """The dataset with commands that hold where its tails lost a share each second, by run."""
    runs = []
    for run, rate in zip(dataset.runs, rates, strict=True):
        times = np.union1d(run.commands.times_s, run.time_s[::10])
        row = np.searchsorted(run.commands.times_s, times, side="right") - 1
        values = run.commands.values[row]
        middle = 0.5 * (times + np.r_[times[1:], run.time_s[-1]])
        values[:, FREQUENCY] /= 1.0 - rate * middle
        runs.append(replace(run, commands=CommandSteps(times, values)))
    return replace(dataset, runs=tuple(runs))


@pytest.fixture(scope="module")
def dataset():
    return simulate(SETUP)


def test_runs_that_beat_alike_have_no_beat_of_their_own(dataset):
    assert own_beats(SeriesProblem(dataset)).own == {}
    quicker = own_beats(SeriesProblem(told(dataset, [1.01] * 5)))
    assert quicker.own == {}
    assert quicker.drive.scale == pytest.approx(1.01, abs=1e-3)


def test_each_runs_own_beat_is_found_beside_a_common_one(dataset):
    ratios = np.array([1.0, 1.008, 0.99, 1.0, 1.0])
    problem = SeriesProblem(told(dataset, 0.97 * ratios))
    beats = own_beats(problem)
    assert beats.drive.scale == pytest.approx(0.97, abs=1e-3)
    for found, ratio in zip(beats.own.values(), ratios, strict=True):
        assert found == pytest.approx(ratio, abs=1e-3)
    assert max(map(abs, beats.sags.values())) < 1e-4


def test_each_runs_own_sag_is_found(dataset):
    rates = np.array([0.0, 6e-4, 2e-4, 0.0, 9e-4])
    beats = own_beats(SeriesProblem(sagging(dataset, rates)))
    found = np.array(list(beats.sags.values()))
    np.testing.assert_allclose(found - found.mean(), rates - rates.mean(), atol=1e-4)


def test_the_commands_are_those_that_the_tail_followed(dataset):
    problem = SeriesProblem(told(dataset, [1.0, 1.008, 1.0, 1.0, 1.0]))
    right = with_own_beats(problem, OwnBeats(TailDrive(), {"r1": 1.008}))
    expected = SeriesProblem(dataset).runs[1].command_values
    assert np.allclose(right.runs[1].driven[1], expected)
    assert with_own_beats(problem, OwnBeats()).runs is problem.runs


def test_a_sagging_tail_loses_phase_with_the_square_of_time(dataset):
    problem = SeriesProblem(dataset)
    (run,) = (
        with_own_beats(problem, OwnBeats(TailDrive(), {"r1": 1.0}, {"r1": 1e-3})).some([1]).runs
    )
    times, values = run.driven
    end = 10.0
    spans = np.diff(np.clip([*times, run.duration], 0.0, end))
    told_times, told = run.command_times, run.command_values
    row = np.searchsorted(told_times, np.arange(0.005, end, 0.01), side="right") - 1
    lost = 0.01 * 1e-3 * (told[row, FREQUENCY] * np.arange(0.005, end, 0.01)).sum()
    told_spans = np.diff(np.clip([*told_times, run.duration], 0.0, end))
    beats = told_spans @ told[:, FREQUENCY] - spans @ values[:, FREQUENCY]
    assert beats == pytest.approx(lost, rel=1e-3)


def test_two_runs_that_differ_are_enough_beside_a_misfit():
    """Where the model misses something, as it does before causes are known."""
    ratios = np.array([1.0, 1.0022, 0.9978, 1.0, 1.0])
    wrong = simulate(replace(SETUP, changes={"tail.lift.c1": 6.5}))
    beats = own_beats(SeriesProblem(told(wrong, ratios)))
    assert max(beats.gains.values()) < IDENTIFICATION.clear_own_beat
    lost = 0.5 * SETUP.duration * np.array(list(beats.sags.values()))
    found = np.array(list(beats.own.values())) * (1.0 - lost)
    np.testing.assert_allclose(found, ratios, atol=IDENTIFICATION.least_beat_difference)


SLOW = {"servo_rate_limit": {"rate": 2.5}}
RATIOS = np.array([1.0, 1.0025, 0.9975, 1.0, 1.002])


@pytest.fixture(scope="module")
def slow(dataset):
    """The same manoeuvres with a tail that is slow."""
    rng, swum = np.random.default_rng(5), []
    for run in dataset.runs:
        fish = replace(load_fish(FISH), effects=SLOW)
        own = Simulator(fish).run(run.commands, SETUP.duration, rate_hz=SETUP.rate)
        count = len(own.time_s)
        shown = {n: own[n] + sd * rng.standard_normal(count) for n, sd in SENSOR_SD.items()}
        swum.append(
            Run.from_steps(run.id, own.time_s, shown, run.commands, start="rest", tail_phase=0.0)
        )
    return replace(dataset, runs=tuple(swum))


def test_a_late_tail_does_not_hide_how_runs_differ(slow):
    """Beside a tail that is not late, they seem to differ by half a per cent more."""
    problem = SeriesProblem(told(slow, RATIOS))
    beats = own_beats(problem)
    lost = 0.5 * SETUP.duration * np.array(list(beats.sags.values()))
    found = np.array(list(beats.own.values())) * (1.0 - lost)
    np.testing.assert_allclose(found, RATIOS, atol=IDENTIFICATION.least_beat_difference)
    assert not any(id.effect.startswith("servo") for id in beats.drive.measured)


def test_a_late_tail_alone_makes_no_runs_differ(slow):
    assert own_beats(SeriesProblem(slow)).own == {}


@pytest.mark.parametrize("differ", [False, True])
def test_only_runs_that_differ_may_have_a_beat_of_their_own(dataset, differ):
    own = {"r1": 1.004} if differ else {}
    problem = with_own_beats(SeriesProblem(dataset), OwnBeats(TailDrive(), own))
    noise = problem.default_noise()
    filtered = problem.filtered(problem.start, noise, keep_slopes=True)
    steps = np.array([0.3 * v.usual for v in problem.variations])
    slopes = problem.variation_slopes(problem.start, noise, filtered, steps)
    assert np.abs(slopes[:, [BEAT, SAG]]).max(axis=0).astype(bool).tolist() == [differ, differ]


def test_what_ordinary_runs_share_by_chance_is_no_cause(dataset):
    ratios = np.array([1.0, 0.994, 0.996, 0.999, 0.997])
    beats = own_beats(SeriesProblem(told(dataset, ratios)), differ=True)
    assert not beats.drive.in_step
    assert beats.drive.known
    np.testing.assert_allclose(list(beats.own.values()), ratios, atol=2e-3)
    beats = own_beats(SeriesProblem(told(dataset, 0.98 * ratios)), differ=True)
    assert beats.drive.in_step == {SCALE: pytest.approx(0.98 * ratios.mean(), abs=1e-3)}
    beats = own_beats(SeriesProblem(sagging(dataset, np.full(5, 1e-3))), differ=True)
    assert beats.drive.in_step == {RATE: pytest.approx(1e-3, rel=0.1)}


@pytest.mark.parametrize("certain", [False, True])
def test_a_doubtful_law_of_the_beat_is_left_to_the_runs(dataset, certain):
    problem = SeriesProblem(told(dataset, [1.0, 1.008, 0.99, 1.0, 1.0]))
    law = tail_drive({EffectParameterId("beat_load", "load"): 1e-4, SCALE: 1.0}, certain)
    beats = own_beats(problem.with_drive(law))
    assert ("beat_load" in beats.drive.effects) == certain


def test_runs_do_not_differ_because_a_doubtful_law_of_the_beat_is_wrong(dataset):
    """By the law each run beats otherwise than commanded; without it all beat as they are told."""
    law = {SCALE: 1.012, EffectParameterId("beat_load", "load"): 0.01}
    found = own_beats(SeriesProblem(dataset).with_drive(tail_drive(law, certain=False)))
    assert found.own == {}
    assert found.drive.effects == frozenset()
    assert found.drive.scale == pytest.approx(1.0, abs=1e-3)


def test_beginnings_that_mislead_do_not_decide(dataset):
    """A comb about their frequency would end before that of most of the time."""
    runs = []
    for run in told(dataset, [0.93] * 5).runs:
        late, values = run.commands.times_s >= 8.0, run.commands.values.copy()
        values[late, FREQUENCY] *= 0.93
        runs.append(replace(run, commands=CommandSteps(run.commands.times_s, values)))
    beats = own_beats(SeriesProblem(replace(dataset, runs=tuple(runs))))
    assert beats.drive.scale == pytest.approx(1.0, abs=0.015)


def budget_beside_own_beats(dataset):
    """Misfit, and shares of it, where tails beat differently and a coefficient may be off."""
    ratios = {f"r{i}": ratio for i, ratio in enumerate([1.0, 1.03, 0.97, 1.02, 0.98])}
    problem = SeriesProblem(told(dataset, np.array([*ratios.values()])), paths=PATHS)
    problem = with_own_beats(problem, OwnBeats(TailDrive(), ratios))
    noise = problem.default_noise()
    accepted = fit(problem, (), problem.start, noise, refit_noise=False, iterations=3)
    budget = error_budget(problem, accepted, (), problem.run_ids, True, True)
    return budget.misfit, {share.name: share.share for share in budget.shares}


def test_the_error_budget_gives_tails_that_beat_differently_to_the_runs(dataset):
    """The nominal simulation follows commands, whatever was measured of the tails beforehand."""
    misfit, shares = budget_beside_own_beats(dataset)
    assert misfit > 10.0
    assert shares["run_variation"] > 0.9


def test_channels_that_are_sampled_less_often_count_the_same():
    data = simulate(replace(SETUP, changes={"body.plane_xy.drag.c0": 1.6}))
    runs = [
        replace(r, channels={n: np.where(np.arange(len(a)) % 4, np.nan, a) if n in "pqr" else a
                             for n, a in r.channels.items()})
        for r in data.runs
    ]  # fmt: skip
    thinned = replace(data, runs=tuple(runs))
    (_, every), (_, fewer) = map(budget_beside_own_beats, (data, thinned))
    assert 0.1 < every["coefficients"] < 0.9
    assert fewer["coefficients"] == pytest.approx(every["coefficients"], abs=0.03)
