"""P-values too small for a number."""

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from fish_env.inference.tails import chi2_log_tail, noncentrality


@pytest.mark.parametrize("freedom", [1, 2, 3, 8])
def test_tails_of_chi_squared_go_on_where_scipy_ends(freedom):
    near = np.array([0.0, 1.0, 30.0, 900.0, 1150.0, 1300.0])
    np.testing.assert_allclose(chi2_log_tail(near, freedom), chi2.logsf(near, freedom), rtol=1e-9)
    slope = np.diff(chi2_log_tail([1e5, 1e5 + 9.0, 1e6, 1e6 + 9.0], freedom))
    np.testing.assert_allclose(slope[[0, 2]], -4.5, rtol=0.01)
    assert np.isneginf(chi2.logsf(3000.0, freedom))  # what made strong causes all alike


@pytest.mark.parametrize("power", [0.5, 0.8, 0.95])
@pytest.mark.parametrize("log_p", [-3.0, -12.0, -60.0])
@pytest.mark.parametrize("freedom", [1, 3, 9])
def test_a_noncentral_statistic_passes_the_threshold_with_the_power(freedom, log_p, power):
    threshold = chi2.isf(np.exp(log_p), freedom)
    size = noncentrality(log_p, freedom, power)
    assert ncx2.sf(threshold, freedom, size) == pytest.approx(power, rel=1e-6)
