"""Scores summed over blocks of residuals."""

import numpy as np

from fish_env.inference.estimate.information import block_index, sums_over


def test_sums_do_not_depend_on_the_order_of_the_residuals():
    rng = np.random.default_rng(0)
    run_of = np.repeat([0, 1, 2], 40)
    index = block_index(run_of, np.tile(np.linspace(0.0, 9.0, 40), 3))
    scores = rng.standard_normal((120, 3))
    expected = [[column[index == block].sum() for column in scores.T] for block in np.unique(index)]
    np.testing.assert_allclose(sums_over(index, scores), expected, atol=1e-13)
    mixed = rng.permutation(120)
    np.testing.assert_allclose(sums_over(index[mixed], scores[mixed]), expected, atol=1e-13)
