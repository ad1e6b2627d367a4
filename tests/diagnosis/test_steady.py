"""Diagnosis of tables of steady motion: the orbits, the fit, and verdicts on hidden cases."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fish_env.data import SteadyDataset, load_dataset
from fish_env.diagnosis import diagnose
from fish_env.diagnosis.policy import policies_as_dict
from fish_env.diagnosis.tables.pipeline import diagnose_steady, refitted, untold
from fish_env.effects.extended import build_model
from fish_env.errors import DatasetError
from fish_env.identification.tables.orbit import dies_out
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import table_of
from fish_env.inference.adequacy import adequacy
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.inference.projection import Signal
from fish_env.inference.screening import null_threshold
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
    return TableProblem(table_of(table()), load_fish("zheng-2021-a"))


@cache
def fitted():
    return refitted(honest())


def test_orbits_are_the_motion_that_waiting_leads_to():
    problem = honest()
    orbits = problem.orbits(problem.start)
    assert orbits.found.all()
    waited = steady_motion(problem.fish, problem.table.commands, tolerance=1e-5)
    for name, found in zip(NAMES, problem.means(orbits)[0].T, strict=True):
        np.testing.assert_allclose(found, waited[name], atol=2e-5)
    straight = waited["turn_radius"] > 1e3
    curvature = np.where(straight, 0.0, 1.0 / waited["turn_radius"])
    told = replace(problem.table, observations=("curvature",))
    found = problem.with_table(told).means(orbits)[0, :, 0]
    np.testing.assert_allclose(found, curvature, atol=1e-3)


def test_an_effect_that_slows_the_tail_is_the_slower_command():
    problem = honest()
    slowed = problem.orbits(
        Point(problem.start.z, {EffectParameterId("frequency_scale", "scale"): 0.9})
    )
    commands = problem.table.commands.copy()
    commands[:, 2] *= 0.9
    told = problem.with_table(replace(problem.table, commands=commands))
    expected = told.means(told.orbits(told.start))
    np.testing.assert_allclose(problem.means(slowed), expected, atol=2e-5)


def test_measurement_effects_are_those_of_the_simulator():
    problem = honest()
    effects = {"position_scale": {"scale": 1.1}, "attitude_misalignment": {"yaw": 0.05}}
    point = Point(
        problem.start.z,
        {EffectParameterId(e, p): v for e, own in effects.items() for p, v in own.items()}
        | {
            EffectParameterId("attitude_misalignment", "roll"): 0.0,
            EffectParameterId("attitude_misalignment", "pitch"): 0.0,
        },
    )
    found = problem.means(problem.orbits(point))[0]
    waited = steady_motion(build_model(problem.fish, effects), problem.table.commands)
    for name, values in zip(NAMES, found.T, strict=True):
        np.testing.assert_allclose(values, waited[name], atol=5e-5)


def test_a_batch_is_what_each_point_is_alone():
    problem, noise = honest(), honest().default_noise()
    z = np.column_stack([problem.start.z, 0.1 * np.eye(len(problem.baseline))[:, :6]])
    effects = {EffectParameterId("tail_gain", "gain"): np.r_[np.ones(6), 0.9]}
    together = problem.innovations(z, effects, noise, problem.filtered(problem.start, noise))
    for i, row in enumerate(together):
        point = Point(z[:, i], {path: float(own[i]) for path, own in effects.items()})
        alone = np.concatenate([s.residuals for s in problem.filtered(point, noise)])
        np.testing.assert_allclose(row, alone, atol=5e-3)
    assert np.abs(together[1:] - together[0]).max() > 0.1


def test_what_is_not_steady_is_told_and_has_no_likelihood():
    problem = honest()
    noise = problem.default_noise()
    lost = Point(problem.start.z, {EffectParameterId("frequency_scale", "scale"): 0.05})
    near = problem.filtered(problem.start, noise)
    found = problem.filtered(lost, noise, near)
    assert not np.isfinite(sum(s.log_likelihood for s in found))
    effects = {path: np.array([value]) for path, value in lost.effects.items()}
    assert not np.isfinite(problem.innovations(lost.z[:, None], effects, noise, near)).all()


def test_an_orbit_that_grows_is_not_steady():
    map_of = [0.9 * np.eye(8), np.diag([1.2, *[0.5] * 7]), np.full((8, 8), np.nan)]
    slopes = np.stack([np.vstack([own, np.full((7, 8), 3.0)]) for own in map_of])
    assert dies_out(slopes).tolist() == [True, False, False]


@pytest.mark.slow
@pytest.mark.long
def test_effects_that_averages_tell_nothing_of_are_found_out():
    absent = untold(honest(), fitted())
    assert absent > {"current", "wave", "water_ingress", "surface_drag", "tether"}
    assert absent > {"servo_delay", "sensor_delay", "gyro_bias"}
    assert not absent & {"servo_lag", "linear_drag", "tail_bias", "position_scale"}


def test_the_noise_is_found():
    found = fitted().noise
    assert found.sd.mean(axis=0) == pytest.approx(SD, rel=0.5)
    assert not found.assumed


def test_the_fit_reaches_the_floor_and_a_broken_model_does_not():
    left = adequacy(fitted(), np.random.default_rng(0))
    assert left.reached
    assert left.lack.ratio < 2.0
    problem = TableProblem(table_of(table({"tail_bias": {"offset": 0.15}})), honest().fish)
    broken = adequacy(refitted(problem), np.random.default_rng(0))
    assert not broken.reached
    assert broken.lack.p_value < 1e-6


def test_where_repeats_are_few_nothing_is_said_of_the_fit():
    problem = TableProblem(table_of(table(repeats=1)), honest().fish)
    assert problem.lack_of_fit(fit(problem, rounds=1)) is None


def test_a_held_wrench_is_what_an_added_force_does():
    """The generic term of a constant yaw moment, against a fish with that moment."""
    own = fitted()
    terms = own.problem.generic_terms(own)
    words = [terms.words(column) for column in terms.columns.tolist()]
    column = words.index(("constant", "yaw"))
    size = terms.unit(column)
    point = Point(own.point.z, {EffectParameterId("applied_wrench", "mz"): size})
    pushed = own.problem.filtered(point, own.noise, own.filtered)
    change = np.concatenate([s.residuals for s in pushed]) - own.linearised.residuals
    found = terms.changes(np.array([column]))[:, 0]
    np.testing.assert_allclose(found, change, atol=0.05 * np.abs(change).max())


def test_the_threshold_holds_for_the_largest_of_many_under_a_noise_that_is_estimated():
    rng = np.random.default_rng(1)
    left = np.linalg.qr(rng.standard_normal((60, 20)))[0]
    signals = [Signal(None, 0, left[:, [i]], 1.0, np.eye(1), np.zeros(1), 1.0) for i in range(20)]
    threshold = null_threshold(signals, rng, 0.05, freedom=40.0)
    draws = rng.standard_normal((2000, 60)) @ left
    size = rng.chisquare(40, 2000) / 40
    from scipy.stats import chi2

    smallest = chi2.logsf(draws**2 / size[:, None], 1).min(axis=1)
    assert np.mean(smallest < threshold) == pytest.approx(0.05, abs=0.025)
    assert threshold < null_threshold(signals, rng, 0.05)


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
    with pytest.raises(DatasetError, match="measure at least"):
        diagnose_steady(few)


def at_frequencies(dataset, *frequencies):
    at = np.flatnonzero(np.isin(dataset.commands[:, 2], frequencies))
    return replace(
        dataset,
        ids=tuple(dataset.ids[i] for i in at),
        conditions=tuple(dataset.conditions[i] for i in at),
        commands=dataset.commands[at],
        observations={name: values[at] for name, values in dataset.observations.items()},
    )


@pytest.mark.slow
def test_a_hidden_cause_is_named_with_its_size(tmp_path):
    truth = make_case("steady", 1, tmp_path / "data")
    rows = at_frequencies(load_dataset(tmp_path / "data"), 2.2)  # a quarter, a fifth of the time
    answer = diagnose_steady(rows, out=tmp_path / "out", quick=True)
    assert answer["verdict"] == "cause"
    assert [cause["name"] for cause in answer["causes"]] == ["tail_bias"]
    low, high = answer["causes"][0]["parameters"]["offset"]["ci95"]
    assert low < truth.effects["tail_bias"]["offset"] < high
    assert answer["gain"]["share_of_reachable"]["estimate"] > 0.9
    assert load_fish(tmp_path / "out" / "extended.yaml").effects["tail_bias"]["offset"] > low


@pytest.mark.slow
@pytest.mark.long
def test_nothing_is_found_where_nothing_is_hidden(tmp_path):
    make_case("steady", 0, tmp_path / "data")
    answer = diagnose(tmp_path / "data", quick=True)
    assert answer["verdict"] == "no_misfit"
    assert answer["causes"] == []
    shown = {p["name"]: p for p in answer["preconditions"]}
    assert not shown["current"]["excited"]
    assert shown["tail_bias"]["excited"]
    again = diagnose(tmp_path / "data", quick=True)
    assert {**again, "runtime_s": 0} == {**answer, "runtime_s": 0}


@pytest.mark.slow
@pytest.mark.long
def test_the_packaged_table_names_no_cause():
    answer = diagnose("msu-steady", quick=True)
    assert answer["verdict"] == "outside_library"
    assert answer["causes"] == []
    assert answer["floor"]["ratio"] > 2.0
    assert answer["unexplained"]
    assert isinstance(load_dataset("msu-steady"), SteadyDataset)


@pytest.mark.parametrize("frequency", [0.0, pytest.param(1.0, marks=pytest.mark.long)])
def test_a_table_whose_tail_never_beats_is_answered(frequency):
    """It says nothing of the tail, so the next condition lets it beat."""
    commands = np.array([(o, 0.0, frequency, 0.0, 0.0) for o in (-0.3, 0.0, 0.3) for _ in range(2)])
    rng = np.random.default_rng(0)
    observed = {name: 1e-3 * rng.standard_normal(len(commands)) for name in NAMES[:3]}
    ids = tuple(f"s{i}" for i in range(len(commands)))
    still = SteadyDataset("still", "zheng-2021-a", ids, (None,) * len(ids), commands, observed)
    answer = diagnose_steady(still, quick=True)
    assert answer["verdict"] == "not_excited"
    assert answer["policy"] == policies_as_dict()
    row = answer["next_experiment"]["schedule"][0]
    assert row["tail_amplitude"] > 0.0
    assert row["tail_frequency"] > 0.0
