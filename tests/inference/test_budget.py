"""Shares of the misfit: by closed forms, and on a problem whose parts are known."""

import numpy as np
import pytest

from fish_env.inference.budget import shares_of


def energies(weights, interaction=0.0):
    """Energies of nothing, everything, each alone and everything but each; parts add up."""
    weights = np.asarray(weights, float)
    whole = weights.sum() + interaction
    alone = whole - weights
    without = weights + interaction
    return np.r_[whole, 0.0, alone, without]


def test_parts_that_do_not_interact_get_what_they_close():
    shares, first, last = shares_of(energies([5.0, 3.0, 2.0]), 3)
    np.testing.assert_allclose(shares, [5.0, 3.0, 2.0])
    np.testing.assert_allclose(first, last)


@pytest.mark.parametrize("interaction", [-1.0, 2.0])
def test_shares_add_up_to_what_all_close(interaction):
    energy = energies([5.0, 3.0], interaction)
    shares, _, _ = shares_of(energy, 2)
    assert shares.sum() == pytest.approx(energy[0] - energy[1])


def test_two_parts_share_as_shapley_does():
    """Of two parts the first and the last place are all there are."""
    nothing, both, one, other = 10.0, 1.0, 4.0, 8.0
    shares, _, _ = shares_of(np.array([nothing, both, one, other, other, one]), 2)
    shapley = 0.5 * ((nothing - one) + (other - both))
    assert shares[0] == pytest.approx(shapley)
    assert shares.sum() == pytest.approx(nothing - both)


def test_a_part_that_does_nothing_has_no_share():
    shares, _, _ = shares_of(energies([5.0, 0.0]), 2)
    assert shares[1] == pytest.approx(0.0)
