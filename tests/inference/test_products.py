"""Products of tall matrices that lie in parts."""

import numpy as np
import pytest

from fish_env.inference.estimate.products import BLOCK, TOGETHER, gram


@pytest.mark.parametrize("rows", [1, BLOCK, TOGETHER, 3 * TOGETHER + 17])
def test_a_gram_of_parts_is_that_of_the_whole(rows):
    rng = np.random.default_rng(rows)
    whole = rng.standard_normal((rows, 7)).astype(np.float32)
    found = gram([whole[:, :2], whole[:, 2:3], whole[:, 3:]])
    exact = whole.astype(float).T @ whole.astype(float)
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.sqrt(rows))
    np.testing.assert_array_equal(found, gram([whole]))  # however it is parted
