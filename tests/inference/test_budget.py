"""Shares of the misfit: by closed forms, and on a problem whose parts are known."""

import numpy as np
import pytest

from fish_env.inference.budget import Budget, Other, Share, shares_of
from fish_env.inference.policy import POLICY


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


def budget(last=0.0, **channels):
    """A budget of components with these shares of two channels, and of what is lost without."""
    others = {other.value: other for other in Other}
    shares = [
        Share(others.get(name, name), 0.0, None, 0.0, last, {"x": x, "z": z})
        for name, (x, z) in channels.items()
    ]
    return Budget(("r1", "r2"), True, 100.0, tuple(shares), 0.0, None)


LITTLE = 0.5 * POLICY.least_named_share


def test_a_cause_is_minor_that_does_next_to_nothing_in_any_channel():
    found = budget(coefficients=(0.0, 0.0), drag=(0.6, 0.1), play=(LITTLE, -0.3))
    assert found.minor() == ("play",)


def test_a_cause_that_shows_in_one_channel_is_not_minor():
    assert budget(drag=(0.6, 0.1), lag=(-0.2, 2.0 * POLICY.least_named_share)).minor() == ()


def test_a_cause_that_others_need_is_not_minor():
    """Beside another one alone it makes everything worse."""
    own = {"drag": (0.6, 0.1), "marker": (-0.3, -0.3)}
    assert budget(**own).minor() == ("marker",)
    assert budget(last=2.0 * POLICY.least_named_share, **own).minor() == ()


@pytest.mark.parametrize("causes", [("lag",), ("lag", "play")])
def test_no_cause_is_minor_beside_none_that_does_more(causes):
    """However much coefficients and what runs differ in explain: their models are not in doubt."""
    shares = dict.fromkeys(causes, (LITTLE, 0.0))
    assert budget(coefficients=(0.9, 0.9), run_variation=(0.1, 0.1), **shares).minor() == ()


def test_what_builds_up_slowly_is_not_minor():
    """A wrong clock changes little in a prediction of some seconds."""
    found = budget(drag=(0.6, 0.1), clock=(LITTLE, 0.0), play=(LITTLE, 0.0))
    assert found.minor(slow=["clock"]) == ("play",)
