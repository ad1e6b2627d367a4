"""What a policy sees of the past: frames and filters, fish by fish."""

import math

import numpy as np
import pytest

from fish_env.errors import ConfigError
from robofish_agents.policies import History, HistorySpec

SPEC = HistorySpec(frames=3, low_pass_s=(0.5, 2.0))
SIZE = 4


def series(steps: int, lanes: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return rng.normal(size=(steps, lanes, SIZE)).astype(np.float32)


def test_the_first_observation_was_there_for_ever():
    (first,) = series(1, 2)
    seen = History(SPEC, 2, SIZE).push(first)
    np.testing.assert_array_equal(seen, np.tile(first, 5))


def test_frames_come_newest_first():
    rows = series(5, 1)
    history = History(SPEC, 1, SIZE)
    for row in rows:
        seen = history.push(row)
    np.testing.assert_array_equal(seen[0, : 3 * SIZE], rows[[4, 3, 2], 0].ravel())


def test_a_filter_follows_a_step_as_its_time_constant_says():
    """63 % of a step after one time constant (first-order filter, exact at the samples)."""
    history = History(HistorySpec(1, (2.0,)), 1, SIZE)
    history.push(np.zeros((1, SIZE), np.float32))
    for _ in range(20):
        seen = history.push(np.ones((1, SIZE), np.float32))
    np.testing.assert_allclose(seen[0, SIZE:], 1.0 - np.exp(-1.0), rtol=1e-5)


def test_fish_do_not_see_each_other_and_a_restart_forgets():
    rows = series(6, 3)
    together, alone = History(SPEC, 3, SIZE), History(SPEC, 1, SIZE)
    for step, row in enumerate(rows):
        if step == 3:
            together.restart(np.array([False, True, False]))
            alone = History(SPEC, 1, SIZE)
        seen = together.push(row)
        np.testing.assert_array_equal(seen[1:2], alone.push(row[1:2]))


def test_the_last_observation_is_seen_with_its_own_past():
    rows = series(4, 2)
    history, twin = History(SPEC, 2, SIZE), History(SPEC, 2, SIZE)
    for row in rows[:3]:
        history.push(row)
        twin.push(row)
    seen = twin.push(rows[3])
    for lane in range(2):
        np.testing.assert_array_equal(history.last(lane, rows[3, lane]), seen[lane])
    np.testing.assert_array_equal(history.push(rows[3]), seen)


@pytest.mark.parametrize(
    "wrong",
    [
        {"frames": 0},
        {"frames": 51},
        {"low_pass_s": (0.05,)},
        {"period_s": 0.0},
        {"low_pass_s": (math.nan,)},
        {"low_pass_s": (math.inf,)},
        {"period_s": math.nan},
        {"period_s": math.inf, "low_pass_s": ()},
    ],
)
def test_impossible_pasts_are_refused(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        HistorySpec(**wrong)
