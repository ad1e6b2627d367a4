"""Diagnosis of tables of steady motion: the orbits, the fit, and verdicts on hidden cases."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fish_env.data import SteadyDataset, load_dataset
from fish_env.diagnosis import diagnose
from fish_env.diagnosis.steady.adequacy import lack_of_fit
from fish_env.diagnosis.steady.fitting import fit, with_scatter
from fish_env.diagnosis.steady.orbit import dies_out
from fish_env.diagnosis.steady.problem import SteadyProblem
from fish_env.diagnosis.steady.scatter import linear_changes, scatter_of
from fish_env.diagnosis.steady.screening import Signal, needs_place_or_time, null_threshold
from fish_env.diagnosis.steady.table import table_of
from fish_env.effects.extended import build_model
from fish_env.errors import DatasetError
from fish_env.identification.problem import Point
from fish_env.params import load_fish
from fish_env.steady import steady_motion
from tests.hidden.cases import make_case

DEGREE = np.pi / 180.0
COMMANDS = np.array(
    [
        (offset * DEGREE, amplitude * DEGREE, frequency, 0.0, 0.0)
        for amplitude in (12.0, 25.0)
        for frequency in (1.0, 2.0)
        for offset in (-20.0, 0.0, 15.0)
    ]
)
NAMES = ("surge_speed", "sway_speed", "yaw_rate", "pitch")
SD = np.array([1e-3, 1e-3, 3e-3, 3e-3])


def table(effects=None, values=None, repeats=2, seed=0):
    """A small table of the packaged fish, with effects and coefficients of its own."""
    fish = load_fish("zheng-2021-a").replace(values or {})
    commands = np.repeat(COMMANDS, repeats, axis=0)
    motion = steady_motion(build_model(fish, effects), commands, dt=0.02, tolerance=1e-3)
    rng = np.random.default_rng(seed)
    observed = {
        name: motion[name] + sd * rng.standard_normal(len(commands))
        for name, sd in zip(NAMES, SD, strict=True)
    }
    ids = tuple(f"s{i}" for i in range(len(commands)))
    return SteadyDataset("small", "zheng-2021-a", ids, (None,) * len(ids), commands, observed)


@cache
def honest():
    """A table without any effect, as a problem."""
    return SteadyProblem(table_of(table()), load_fish("zheng-2021-a"))


@cache
def fitted():
    return fit(honest())


def test_orbits_are_the_motion_that_waiting_leads_to():
    problem = honest()
    orbits = problem.orbits([problem.start])
    assert orbits.found.all()
    waited = steady_motion(problem.fish, problem.table.commands, tolerance=1e-5)
    for name, found in zip(NAMES, problem.means(orbits)[0].T, strict=True):
        np.testing.assert_allclose(found, waited[name], atol=2e-5)
    straight = waited["turn_radius"] > 1e3
    curvature = np.where(straight, 0.0, 1.0 / waited["turn_radius"])
    np.testing.assert_allclose(orbits.means["curvature"], curvature, atol=1e-3)


def test_an_effect_that_slows_the_tail_is_the_slower_command():
    problem = honest()
    slowed = problem.orbits([Point(problem.start.z, {"effects.frequency_scale.scale": 0.9})])
    commands = problem.table.commands.copy()
    commands[:, 2] *= 0.9
    told = problem.with_table(replace(problem.table, commands=commands))
    expected = told.means(told.orbits([told.start]))
    np.testing.assert_allclose(problem.means(slowed), expected, atol=2e-5)


def test_measurement_effects_are_those_of_the_simulator():
    problem = honest()
    effects = {"position_scale": {"scale": 1.1}, "attitude_misalignment": {"yaw": 0.05}}
    point = Point(
        problem.start.z,
        {f"effects.{e}.{p}": v for e, own in effects.items() for p, v in own.items()}
        | {"effects.attitude_misalignment.roll": 0.0, "effects.attitude_misalignment.pitch": 0.0},
    )
    found = problem.means(problem.orbits([point]))[0]
    waited = steady_motion(build_model(problem.fish, effects), problem.table.commands)
    for name, values in zip(NAMES, found.T, strict=True):
        np.testing.assert_allclose(values, waited[name], atol=5e-5)


def test_linear_changes_are_those_of_full_orbits():
    problem = honest()
    base = problem.orbits([problem.start])
    nudged = [Point(0.1 * np.eye(len(problem.baseline))[i], {}) for i in range(12)]
    linear = linear_changes(problem, problem.start, base, nudged)
    full = problem.means(problem.orbits(nudged, base)) - problem.means(base)
    np.testing.assert_allclose(linear, full, atol=0.05 * np.abs(full).max(axis=(1, 2)).max())


def test_an_orbit_that_grows_is_not_steady():
    slopes = np.stack([0.9 * np.eye(8), np.diag([1.2, *[0.5] * 7]), np.full((8, 8), np.nan)])
    assert dies_out(slopes).tolist() == [True, False, False]


def test_effects_of_place_heading_and_time_are_found_out():
    names = ["current", "wave", "water_ingress", "surface_drag", "servo_lag", "linear_drag"]
    assert needs_place_or_time(fitted(), names) == set(names[:4])


def test_the_noise_is_found():
    found = fitted().scatter
    assert found.sd.mean(axis=0) == pytest.approx(SD, rel=0.5)
    assert not found.assumed


def test_residuals_reach_the_floor_and_a_broken_model_does_not():
    good, p_value = lack_of_fit(fitted())
    assert good < 2.0
    assert p_value > 0.005
    problem = SteadyProblem(table_of(table({"tail_bias": {"offset": 0.15}})), honest().fish)
    broken = fit(problem)
    assert lack_of_fit(broken)[1] < 1e-6


def test_noise_judges_but_does_not_move_estimates():
    known = fitted()
    doubled = scatter_of(
        2.0 * known.scatter.sensor_sd,
        4.0 * known.scatter.force,
        4.0 * known.scatter.moment,
        np.zeros((2, *known.scatter.sd.shape)),
        False,
    )
    judged = with_scatter(known, replace(doubled, sd=2.0 * known.scatter.sd))
    np.testing.assert_array_equal(judged.estimates, known.estimates)
    count = int(known.problem.table.present.sum())
    np.testing.assert_allclose(judged.residuals[:count], known.residuals[:count] / 2.0)


def test_the_threshold_holds_for_the_largest_of_many():
    rng = np.random.default_rng(1)
    left = np.linalg.qr(rng.standard_normal((60, 20)))[0]
    signals = [Signal(None, 0, left[:, [i]], 1.0, np.eye(1), np.zeros(1), False) for i in range(20)]
    threshold = null_threshold(signals, 40, rng, 0.05)
    draws = rng.standard_normal((2000, 60)) @ left
    size = rng.chisquare(40, 2000) / 40
    from scipy.stats import chi2

    smallest = chi2.logsf(draws**2 / size[:, None], 1).min(axis=1)
    assert np.mean(smallest < threshold) == pytest.approx(0.05, abs=0.025)


def test_repeats_are_found_with_and_without_names():
    unnamed = table_of(table())
    assert len(unnamed.conditions) == len(COMMANDS)
    assert unnamed.repeats == len(COMMANDS) * len(NAMES)
    dataset = table()
    named = replace(dataset, conditions=tuple(f"c{i}" for i in range(len(dataset.ids))))
    assert table_of(named).repeats == 0


def test_a_turn_radius_counts_as_curvature():
    dataset = table()
    radius = np.full(len(dataset.ids), 0.5)
    with_radius = replace(dataset, observations={"turn_radius": radius})
    arranged = table_of(with_radius)
    assert arranged.observations == ("curvature",)
    assert np.all(arranged.values == 2.0)


def test_too_few_conditions_are_refused():
    dataset = table()
    few = SteadyDataset(
        "few", dataset.fish, dataset.ids[:4], dataset.conditions[:4], dataset.commands[:4],
        {name: values[:4] for name, values in dataset.observations.items()},
    )  # fmt: skip
    from fish_env.diagnosis.steady.pipeline import diagnose_steady

    with pytest.raises(DatasetError, match="measure at least"):
        diagnose_steady(few)


@pytest.mark.slow
def test_a_hidden_cause_is_named_with_its_size(tmp_path):
    truth = make_case("steady", 1, tmp_path / "data")
    answer = diagnose(tmp_path / "data", out=tmp_path / "out", quick=True)
    assert answer["verdict"] == "cause"
    assert [cause["name"] for cause in answer["causes"]] == ["tail_bias"]
    low, high = answer["causes"][0]["parameters"]["offset"]["ci95"]
    assert low < truth.effects["tail_bias"]["offset"] < high
    assert answer["gain"]["share_of_reachable"]["estimate"] > 0.9
    assert load_fish(tmp_path / "out" / "extended.yaml").effects["tail_bias"]["offset"] > low
    again = diagnose(tmp_path / "data", quick=True)
    assert {**again, "runtime_s": 0} == {**answer, "runtime_s": 0}


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is_hidden(tmp_path):
    make_case("steady", 0, tmp_path / "data")
    answer = diagnose(tmp_path / "data", quick=True)
    assert answer["verdict"] == "no_misfit"
    assert answer["causes"] == []
    shown = {p["name"]: p for p in answer["preconditions"]}
    assert not shown["current"]["excited"]
    assert shown["tail_bias"]["excited"]


@pytest.mark.slow
def test_the_packaged_table_names_no_cause():
    answer = diagnose("msu-steady", quick=True)
    assert answer["verdict"] == "outside_library"
    assert answer["causes"] == []
    assert answer["floor"]["ratio"] > 2.0
    assert answer["unexplained"]
    assert isinstance(load_dataset("msu-steady"), SteadyDataset)
