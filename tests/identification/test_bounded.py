"""The bounded step against a general solver of quadratic programmes."""

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from fish_env.identification.bounded import bounded_step


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

    found = bounded_step(hessian, gradient, vector, rows, low, high)
    assert np.all(rows @ found <= high + 1e-9)
    assert np.all(rows @ found >= low - 1e-9)
    best = minimize(
        model, vector, method="trust-constr", constraints=[LinearConstraint(rows, low, high)],
        options={"gtol": 1e-9, "xtol": 1e-12, "maxiter": 3000},
    )  # fmt: skip
    assert model(found) <= best.fun + 1e-5


def test_without_bounds_it_is_newtons_step():
    hessian, gradient = np.diag([1.0, 4.0]), np.array([1.0, 2.0])
    none = np.full(2, np.inf)
    found = bounded_step(hessian, gradient, np.zeros(2), np.eye(2), -none, none)
    np.testing.assert_allclose(found, [-1.0, -0.5])
