"""What bounds a fit: the step against a general solver, and what no fish can be."""

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from fish_env.identification import Problem
from fish_env.identification.bounded import bounded_minimum
from fish_env.identification.estimator import default_noise, gauss_newton
from fish_env.identification.free import Free, objective
from tests.identification.synthetic import Setup, simulate


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

    found, pressed = bounded_minimum(hessian, gradient, vector, rows, low, high)
    assert np.all(rows @ found <= high + 1e-9)
    assert np.all(rows @ found >= low - 1e-9)
    best = minimize(
        model, vector, method="trust-constr", constraints=[LinearConstraint(rows, low, high)],
        options={"gtol": 1e-9, "xtol": 1e-12, "maxiter": 3000},
    )  # fmt: skip
    assert model(found) <= best.fun + 1e-5
    at = {i: bool(x > m) for i, (x, m) in enumerate(zip(rows @ found, middle, strict=True))
          if min(high[i] - x, x - low[i]) < 1e-9}  # fmt: skip
    assert pressed == at


def test_without_bounds_it_is_newtons_step():
    hessian, gradient = np.diag([1.0, 4.0]), np.array([1.0, 2.0])
    none = np.full(2, np.inf)
    found, pressed = bounded_minimum(hessian, gradient, np.zeros(2), np.eye(2), -none, none)
    np.testing.assert_allclose(found, [-1.0, -0.5])
    assert not pressed


def test_no_fit_goes_where_no_fish_can_be():
    """Each number may be possible by itself, and all together leave a body without any inertia."""
    paths = ("mass.static_moment_rest[0]", "mass.static_moment_rest[2]")
    problem = Problem(simulate(Setup(runs=1, duration=2.0)), paths=paths)
    free = Free(problem, (), ())
    noise = default_noise(problem)
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
        gauss_newton(problem, free, impossible, noise, 3, 0.1)
