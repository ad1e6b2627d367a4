"""The next experiment: manoeuvres within limits, and separation that no refit can close."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.diagnosis.manoeuvres import DURATION_S, MENU, Manoeuvre
from fish_env.diagnosis.next_experiment import (
    best_of,
    changes_on,
    flown,
    separation,
    unfollowed,
)
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import SENSOR_ERRORS
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.inference.verdict import Verdict
from tests.identification.synthetic import PATHS, Setup, simulate
from tests.inference.stated import Stated, fit_of

LIMITS = {"tail_offset": 0.6, "tail_amplitude": 0.6, "tail_frequency": 2.6,
          "block_displacement": 0.01, "block_angle": 0.6}  # fmt: skip
FASTEST_STROKE = 7.0


def faults(manoeuvre: Manoeuvre) -> list[str]:
    found = [name for row in manoeuvre.schedule for name, limit in LIMITS.items()
             if abs(row[name]) > limit]  # fmt: skip
    stroke = manoeuvre.values[:, 1] * 2 * np.pi * manoeuvre.values[:, 2]
    times = manoeuvre.times_s
    if stroke.max() > FASTEST_STROKE:
        found.append("stroke")
    if times[0] != 0.0 or np.any(np.diff(times) <= 0) or times[-1] >= DURATION_S:
        found.append("times")
    return found


@pytest.mark.parametrize("manoeuvre", MENU, ids=lambda m: m.name)
def test_the_menu_keeps_within_servo_and_tank_limits(manoeuvre):
    assert faults(manoeuvre) == []


def test_a_manoeuvre_beyond_the_servo_would_be_found():
    assert faults(Manoeuvre("too fast", ((0.0, 0.0, 0.6, 2.6, 0.02, 0.0),))) == [
        "block_displacement", "stroke",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "named"),
    [("no_misfit", ("seen",)), ("ambiguous", ("seen", "hardly", "never"))],
)
def test_only_what_a_manoeuvre_shows_is_promised(verdict, named):
    """An offset of depth changes nothing that any manoeuvre could show."""
    rivals, sizes = ("seen", "hardly", "never"), np.array([900.0, 4.0, 0.0])
    weaker = [(0.5 * sizes, manoeuvre) for manoeuvre in MENU[1:]]
    found = best_of(Verdict(verdict), rivals, [*weaker, (sizes, MENU[0])])
    assert found.name == MENU[0].name
    assert found.separates == named
    assert found.separation == pytest.approx(sizes[: len(named)].mean())
    without = best_of(Verdict(verdict), rivals[1:], [(sizes[1:], m) for m in MENU])
    assert (without is None) == (verdict == "no_misfit")


def test_separation_is_what_no_coefficient_follows():
    rng = np.random.default_rng(0)
    slopes, rest = rng.standard_normal((300, 2)), rng.standard_normal(300)
    rest -= slopes @ np.linalg.lstsq(slopes, rest, rcond=None)[0]
    difference = (slopes @ [2.0, -1.0] + rest)[:, None]
    free = unfollowed(slopes, difference, 1e-9 * np.eye(2))
    held = unfollowed(slopes, difference, 1e9 * np.eye(2))
    assert free[0] == pytest.approx(rest @ rest, rel=1e-6)
    assert held[0] == pytest.approx(difference[:, 0] @ difference[:, 0], rel=1e-4)


def test_a_proposed_run_has_no_errors_of_an_old_one():
    """Nor do they stop it where the old one has another number of samples."""
    setup = Setup(runs=1)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    found = fit(problem, (), Point(np.zeros(len(PATHS)), {}), setup.noise, rounds=0)
    plain = flown(found, MENU[0]).runs[0]
    spoilt = [
        replace(
            run, distortion=np.ones_like(run.measured), sensor_errors=np.ones(len(SENSOR_ERRORS))
        )
        for run in problem.runs
    ]
    new = flown(replace(found, problem=problem.with_runs(spoilt)), MENU[0]).runs[0]
    assert len(new.clock) != len(problem.runs[0].clock)
    assert np.array_equal(new.corrected, plain.corrected)
    assert not new.sensor_errors.any()
    assert np.ptp(new.corrected[:, 0]) > 0.0


def with_quick_lag(seconds):
    """A fit with a lag of the wake that steps of 0.02 s cannot follow."""
    setup = Setup(runs=1)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    lag = {EffectParameterId("wake_memory", "time_constant"): seconds}
    return fit(problem, ("wake_memory",), Point(np.zeros(len(PATHS)), lag), setup.noise, rounds=0)


def test_a_manoeuvre_is_simulated_in_steps_that_the_fit_needs():
    found = with_quick_lag(0.006)
    apart = separation(found, [Point(found.point.z, {})], MENU[0])
    fastest = np.abs(flown(found, MENU[0]).runs[0].measured).max()
    assert fastest < 10.0
    assert np.isfinite(apart).all()
    with np.errstate(all="ignore"):
        diverged = flown(in_long_steps(found), MENU[0]).runs[0].measured
    assert not np.abs(diverged).max() < 1.5 * fastest


def in_long_steps(found):
    """The fit in steps of 0.02 s, in which the lag diverges."""
    problem = found.problem
    longer = [run.in_long_steps() for run in problem.runs]
    return replace(found, problem=problem.with_runs(longer))


@pytest.mark.parametrize("nonsense", [np.nan, np.inf, 1e200])
def test_a_rival_that_cannot_be_simulated_is_not_said_to_be_separated(nonsense):
    def residuals(z, effects):
        return np.full((1, 3), nonsense if z[0] > 5.0 else z[0])

    problem = Stated(residuals, paths=("c",))
    rivals = [Point(np.array([c]), {}) for c in (9.0, 2.0)]
    fitted = fit_of(problem, point=Point(np.zeros(1), {}))
    slopes, differences = changes_on(problem, fitted, problem.default_noise(), rivals)
    assert slopes[:, 0] == pytest.approx(np.ones(3))
    assert np.array_equal(differences, [[0.0, 2.0]] * 3)
