"""What bounds a fit: coefficients under a correlated prior, steps, and what no fish can be."""

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from fish_env.data import load_dataset
from fish_env.identification import SeriesProblem, WholeRunProblem
from fish_env.identification.parameters import Baseline
from fish_env.identification.tables.problem import TableProblem
from fish_env.identification.tables.table import table_of
from fish_env.inference.estimate.bounds import (
    LinearBounds,
    coefficient_range,
    coefficients_at_bounds,
    parameter_bounds,
)
from fish_env.inference.estimate.fit import fit, gauss_newton
from fish_env.inference.estimate.free import Free, objective
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.policy import POLICY
from fish_env.inference.problem import Point
from fish_env.params import load_fish
from tests.identification.synthetic import PATHS, Setup, simulate

FISH = "msu-tail-fish"
PAIR = ("mass.total", "mass.buoyancy")
"""They move together: their difference is known far better than either."""


@pytest.mark.parametrize("seed", range(12))
def test_step_is_the_minimum_within_bounds(seed):
    rng = np.random.default_rng(seed)
    n = 6
    root = rng.standard_normal((n, n))
    hessian, gradient = root @ root.T + 0.1 * np.eye(n), 5.0 * rng.standard_normal(n)
    rows = np.eye(n) + 0.3 * np.tril(rng.standard_normal((n, n)), -1)
    vector = 0.1 * rng.standard_normal(n)
    middle = rows @ vector
    low, high = middle - rng.uniform(0.0, 0.5, n), middle + rng.uniform(0.0, 0.5, n)
    high[0], low[1] = np.inf, -np.inf

    def model(x):
        return 0.5 * (x - vector) @ hessian @ (x - vector) + gradient @ (x - vector)

    bounds = LinearBounds(rows, low, high)
    found = vector + bounds.step(hessian, gradient, vector)
    assert np.all(rows @ found <= high + 1e-9)
    assert np.all(rows @ found >= low - 1e-9)
    best = minimize(
        model, vector, method="trust-constr", constraints=[LinearConstraint(rows, low, high)],
        options={"gtol": 1e-9, "xtol": 1e-12, "maxiter": 3000},
    )  # fmt: skip
    assert model(found) <= best.fun + 1e-5
    there = gradient + hessian @ (found - vector)
    at = np.minimum(high - rows @ found, rows @ found - low) < 1e-9
    np.testing.assert_array_equal(bounds.active(hessian, there, found), rows[at])


def test_a_vector_is_clipped_to_the_nearest_values_allowed():
    bounds = LinearBounds(np.array([[2.0, 0.0], [1.0, 1.0]]), np.zeros(2), np.array([2.0, 9.0]))
    np.testing.assert_allclose(bounds.clip(np.array([3.0, 1.0])), [1.0, 3.0])
    inside = np.array([0.1, 0.7])
    np.testing.assert_array_equal(bounds.clip(inside), inside)


def test_a_correlated_prior_bounds_the_coefficients_themselves():
    """All of the range may be used, and no more, whatever the other coefficient does."""
    baseline = Baseline(load_fish(FISH), PAIR)
    assert baseline.factor[1, 0] > 0.5 * baseline.sd[1]
    bounds = parameter_bounds(baseline, (), ())
    low, high = coefficient_range(baseline)
    for goal in np.array([[9.0, 9.0], [9.0, -9.0], [-9.0, 9.0], [-9.0, -9.0]]):
        wanted = np.linalg.solve(baseline.factor, goal * baseline.sd)
        found = bounds.clip(wanted)
        values = baseline.values(found[:, None])[:, 0]
        ends = np.where(goal > 0.0, high, low)
        np.testing.assert_allclose(values, ends, atol=2e-3 * baseline.sd.max())
        assert coefficients_at_bounds(baseline, values) == [*map(Coefficient, PAIR)]
        step = bounds.step(np.eye(2), -wanted, np.zeros(2))
        stepped = baseline.values(step[:, None])[:, 0]
        assert np.all((stepped >= low) & (stepped <= high))
    # Along the diagonal of the factor alone, which stands for the conditional deviations.
    diagonal = (high - baseline.mean) / np.diag(baseline.factor)
    assert np.any(baseline.values(diagonal[:, None])[:, 0] > high + baseline.sd)


def test_a_lifted_prior_leaves_the_physical_bounds():
    baseline = Baseline(load_fish(FISH), PAIR)
    low, high = coefficient_range(baseline)
    assert high[0] == pytest.approx(baseline.mean[0] + POLICY.prior_reach_sd * baseline.sd[0])
    low, high = coefficient_range(baseline, baseline.ids[:1])
    assert (low[0], high[0]) == (baseline.bounds[0][0], baseline.bounds[1][0])
    assert high[1] == pytest.approx(baseline.mean[1] + POLICY.prior_reach_sd * baseline.sd[1])


def test_runs_tables_and_whole_runs_have_the_same_bounds():
    """One policy: the same fish may become the same, whatever it was measured by."""
    fish, paths = load_fish(FISH), (*PAIR, "tail.lift.c1", "body.plane_xy.drag.c0")
    measured = simulate(Setup(runs=1, duration=2.0))
    problem = SeriesProblem(measured, fish, paths=paths)
    whole = Free(WholeRunProblem(measured, fish, paths=paths), (), ()).bounds
    runs = Free(problem, (), ()).bounds
    for name in ("rows", "low", "high"):
        np.testing.assert_array_equal(getattr(runs, name), getattr(whole, name))
    table = TableProblem(table_of(load_dataset("msu-steady")), fish, paths=paths[2:], dt=0.05)
    table.table.values[:, 0] += 0.2  # four times as fast as it swims
    estimates = fit(table, rounds=1).estimates
    low, high = coefficient_range(table.baseline)
    assert np.all((estimates >= low) & (estimates <= high))
    assert coefficients_at_bounds(table.baseline, estimates)


def test_no_fit_goes_where_no_fish_can_be():
    """Each number may be possible by itself, and all together leave a body without any inertia."""
    paths = ("mass.static_moment_rest[0]", "mass.static_moment_rest[2]")
    problem = SeriesProblem(simulate(Setup(runs=1, duration=2.0)), paths=paths)
    free = Free(problem, (), ())
    noise = problem.default_noise()
    value, filtered = objective(problem, free, np.zeros(2), noise)
    assert np.isfinite(value)
    assert len(filtered) == 1
    # Far off the axes: the model keeps no products of inertia to go with such a balance.
    impossible = (np.array([-0.5, 0.3]) - problem.baseline.mean) / problem.baseline.sd
    assert not problem.baseline.possible(impossible)
    several = np.column_stack([impossible, np.zeros(2), impossible, np.zeros(2)])
    assert problem.baseline.all_possible(several).tolist() == [False, True, False, True]
    assert objective(problem, free, impossible, noise) == (np.inf, [])
    with pytest.raises(np.linalg.LinAlgError):
        gauss_newton(problem, Slopes(free, noise), impossible, 3, 0.1)


def test_what_is_infinite_begins_at_its_mildest_plausible_value():
    """No derivative leads away from infinity, and one infinite number spoils every bound."""
    problem = SeriesProblem(simulate(Setup(runs=1, duration=2.0)), paths=PATHS)
    free = Free(problem, ["wave"], ())
    off = Point(np.zeros(len(PATHS)), problem.neutral(["wave"]))
    assert np.isinf(list(off.effects.values())).any()
    vector = free.bounds.clip(free.pack(off))
    assert np.isfinite(vector).all()
