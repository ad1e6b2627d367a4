"""P-values of scores whose spread is read off few blocks, and of those too small for a number."""

import numpy as np
import pytest
from scipy.special import polygamma
from scipy.stats import chi2, f, kstest

from fish_env.diagnosis.moderation import ENDLESS, Spreads, moderated, spreads
from fish_env.diagnosis.tails import chi2_log_tail, f_log_tail

TESTS, BLOCKS = 3000, 30


def scores(rng, few, colour=1.0):
    """Energies and sums of many tests, most of their energy in a few blocks, and what they find.

    Args:
        rng: random numbers.
        few: blocks that hold nearly all of a test.
        colour: variance of the sums, one or one for each test.
    """
    energy = rng.uniform(0.5, 1.5, (BLOCKS, TESTS))
    energy[few:] *= 0.02
    sums = np.sqrt(colour * energy) * rng.standard_normal((BLOCKS, TESTS))
    step = -sums.sum(axis=0) / energy.sum(axis=0)
    return energy, sums + step * energy, step**2 * energy.sum(axis=0)


@pytest.mark.parametrize("few", [3, 8, 30])
def test_spreads_are_unbiased_however_few_blocks_hold_the_signal(few):
    energy, sums, _ = scores(np.random.default_rng(few), few)
    own = spreads(energy, sums)
    assert own.variance.mean() == pytest.approx(1.0, abs=0.05)
    # Mean square over variance of the estimate: the freedom it claims.
    assert 2.0 / own.variance.var() == pytest.approx(np.median(own.freedom), rel=0.35)


def p_values(rng, few, colour, moderate):
    energy, sums, statistic = scores(rng, few, colour)
    own = spreads(energy, sums)
    own = moderated(own) if moderate else own
    return np.exp(f_log_tail(statistic / own.variance, np.full(TESTS, ENDLESS) if not moderate
                             else own.freedom))  # fmt: skip


@pytest.mark.parametrize("few", [3, 8, 30])
@pytest.mark.parametrize("prior", [6.0, np.inf])
def test_p_values_are_uniform_where_every_test_has_a_colour_of_its_own(few, prior):
    """And far from it where the spread of a few blocks is taken for known."""
    rng = np.random.default_rng(int(few + min(prior, 99.0)))
    colour = 1.4 * (1.0 if np.isinf(prior) else prior / rng.chisquare(prior, TESTS))
    good = p_values(np.random.default_rng(1), few, colour, moderate=True)
    assert kstest(good, "uniform").statistic < 0.05
    assert np.mean(good < 0.01) < 0.03
    taken = p_values(np.random.default_rng(1), few, colour, moderate=False)
    assert np.mean(taken < 0.01) > (0.04 if few == 3 else 0.0)


def test_what_all_tests_share_is_found():
    rng = np.random.default_rng(3)
    freedom = rng.uniform(3.0, 30.0, TESTS)
    true = 2.0 * 12.0 / rng.chisquare(12.0, TESTS)
    own = Spreads(true * rng.chisquare(freedom) / freedom, freedom)
    after = moderated(own)
    assert np.median(after.freedom - freedom) == pytest.approx(12.0, rel=0.3)
    errors = [np.mean(np.log(v / true) ** 2) for v in (after.variance, own.variance)]
    assert errors[0] < 0.6 * errors[1]
    assert polygamma(1, 6.0) > errors[0]  # better than the spread of all alone


@pytest.mark.parametrize("freedom", [1, 2, 3, 8])
def test_tails_of_chi_squared_go_on_where_scipy_ends(freedom):
    near = np.array([0.0, 1.0, 30.0, 900.0, 1150.0])
    np.testing.assert_allclose(chi2_log_tail(near, freedom), chi2.logsf(near, freedom), rtol=1e-9)
    slope = np.diff(chi2_log_tail([1190.0, 1199.0, 1201.0, 1210.0, 1e5, 1e5 + 9.0], freedom))
    np.testing.assert_allclose(slope[[0, 2, 4]], -4.5, rtol=0.01)
    assert np.isneginf(chi2.logsf(3000.0, freedom))  # what made strong causes all alike


@pytest.mark.parametrize("freedom", [3.0, 50.0, 1500.0, ENDLESS])
def test_tails_of_f_go_on_where_scipy_ends(freedom):
    near = np.array([0.5, 10.0, 300.0])
    np.testing.assert_allclose(f_log_tail(near, freedom), f.logsf(near, 1, freedom), rtol=1e-7)
    far = np.geomspace(300.0, 1e6, 300)
    tail = f_log_tail(far, freedom)
    assert np.isfinite(tail).all()
    slope = np.diff(tail) / np.diff(np.log(freedom + far))
    assert np.abs(np.diff(slope)).max() < 0.03 * np.abs(slope).max()  # no step at the change
