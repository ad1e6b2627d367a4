"""Products of tall matrices that lie in parts."""

import numpy as np
import pytest

from fish_env.inference.estimate.products import BLOCK, gram, inner


@pytest.mark.parametrize("rows", [1, BLOCK, 2 * BLOCK, 3 * BLOCK + 17])
def test_a_gram_of_parts_is_that_of_the_whole(rows):
    rng = np.random.default_rng(rows)
    whole = rng.standard_normal((rows, 7)).astype(np.float32)
    found = gram([whole[:, :2], whole[:, 2:3], whole[:, 3:]])
    exact = whole.astype(float).T @ whole.astype(float)
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.sqrt(rows))
    np.testing.assert_array_equal(found, gram([whole]))  # however it is parted


def test_products_in_blocks_are_those_of_whole_matrices():
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((1000, 7)), rng.standard_normal((1000, 5))
    np.testing.assert_allclose(inner(a, b), a.T @ b, rtol=1e-12, atol=1e-12)


def test_single_numbers_are_summed_in_64_bits_from_block_to_block():
    rows = 4000 * BLOCK
    ones = np.full((rows, 1), 0.1, np.float32)
    exact = rows * float(ones[0, 0]) ** 2
    assert abs(inner(ones, ones)[0, 0] / exact - 1.0) < 2e-7
    assert abs(np.add.accumulate(ones[:, 0] ** 2)[-1] / exact - 1.0) > 2e-7  # one after another
