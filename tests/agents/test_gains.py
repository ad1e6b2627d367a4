"""Intervals of gains hold the truth as often as they say, with fish as the units."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from robofish_agents.evaluation.intervals import Interval
from scripts.loop import gains
from scripts.loop.gains import difference, over_seeds, per_fish, share_closed
from scripts.loop.training import WITHOUT_MEASUREMENTS

FISH, SEEDS = 5, 5
GAP, SHARE = 80.0, 0.8


def draw(rng, policies=15.0, fish=15.0, seeds=10.0):
    """Made-up scores whose true gain is SHARE x GAP."""
    base = 250.0 + rng.normal(0.0, 10.0, (FISH, 1))
    gap = GAP + rng.normal(0.0, fish, (FISH, 1))
    gain = SHARE * gap + rng.normal(0.0, 5.0, (FISH, 1))
    return {
        "baseline": base + rng.normal(0.0, policies, SEEDS) + rng.normal(0.0, 3.0, (FISH, SEEDS)),
        "extended": base + gain + rng.normal(0.0, seeds, (FISH, SEEDS)),
        "truth": base + gap + rng.normal(0.0, seeds, (FISH, SEEDS)),
    }


def coverage(interval, truth, draws=600, **sizes):
    """How often an interval holds the truth."""
    rng = np.random.default_rng(1)
    found = [interval(draw(rng, **sizes)) for _ in range(draws)]
    return np.mean([low <= truth <= high for _, low, high in found])


def gain(scores) -> Interval:
    return difference(scores, "extended", "baseline")


def closed(scores) -> Interval:
    return share_closed(scores, "extended")


@pytest.mark.parametrize("policies", [0.0, 15.0, 60.0])
def test_intervals_hold_the_truth(policies):
    assert coverage(gain, GAP * SHARE, policies=policies) >= 0.93
    assert coverage(closed, SHARE, policies=policies) >= 0.93


def test_fish_times_seeds_as_units_would_be_too_sure():
    """The check above notices the usual mistake."""

    def pooled(scores) -> Interval:
        values = (scores["extended"] - scores["baseline"]).ravel()
        low, high = ttest_1samp(values, 0.0).confidence_interval()
        return Interval(float(values.mean()), low, high)

    assert coverage(pooled, GAP * SHARE, fish=40.0) < 0.85


def test_leaving_out_that_fish_share_the_baselines_policies_would_be_too_sure(monkeypatch):
    monkeypatch.setattr(gains, "_shared", lambda scores, arm: 0.0)
    assert coverage(gain, GAP * SHARE, policies=60.0) < 0.85


def test_a_difference_without_the_baseline_is_students():
    scores = draw(np.random.default_rng(0))
    low, high = ttest_1samp(per_fish(scores, "truth", "extended"), 0.0).confidence_interval()
    assert difference(scores, "truth", "extended")[1:] == pytest.approx((low, high))


def test_shares_of_none_and_all():
    scores = draw(np.random.default_rng(0))
    assert share_closed({**scores, "extended": scores["truth"]}, "extended") == pytest.approx(
        (1.0, 1.0, 1.0), abs=1e-6
    )
    none = share_closed({**scores, "extended": scores["baseline"]}, "extended")
    assert none.mean == 0.0
    assert none.low <= 0.0 <= none.high


def test_a_share_of_no_gap_is_open():
    """A quarter of nothing may be anything."""
    rng = np.random.default_rng(0)
    alike = {arm: rng.normal(0.0, 1.0, (FISH, SEEDS)) for arm in draw(rng)}
    assert closed(alike)[1:] == (-np.inf, np.inf)


def test_the_same_seeds_are_pairs_on_one_fish():
    scores = draw(np.random.default_rng(0))
    values = scores["extended"][2] - scores["baseline"][2]
    low, high = ttest_1samp(values, 0.0).confidence_interval()
    assert over_seeds(scores, "extended", "baseline", 2)[1:] == pytest.approx((low, high))


def test_two_arms_without_measurements_both_bring_their_chance():
    """Neither differs from fish to fish: all that makes the interval is their policies."""
    rng = np.random.default_rng(0)
    arms = {arm: np.tile(rng.normal(0.0, 5.0, SEEDS), (FISH, 1)) for arm in WITHOUT_MEASUREMENTS}

    def width(scores) -> float:
        low, high = difference(scores, *WITHOUT_MEASUREMENTS)[1:]
        return high - low

    alone = [width({**arms, arm: np.zeros((FISH, SEEDS))}) for arm in WITHOUT_MEASUREMENTS]
    assert min(alone) > 0.0
    assert width(arms) == pytest.approx(np.hypot(*alone))
