"""The search for a teacher's gains finds what it is told to, and its trials see differences."""

import numpy as np

from robofish_agents.training.config import load_train_config
from robofish_agents.training.teacher_gains import TEACHER_GAIN_NAMES, teacher_gains
from scripts.tune_teacher import AIMS, HIGH, LOW, Trial, evolve, merit


def row(**changes: float) -> np.ndarray:
    gains = teacher_gains({**load_train_config("ppo-hold-all").imitate.gains, **changes})
    return np.array([getattr(gains, name) for name in TEACHER_GAIN_NAMES], float)


def test_the_search_finds_the_top_of_a_hill():
    top = np.array([0.3, 0.7, 0.5, 0.2])

    def height(points):
        return -((points - top) ** 2 @ np.array([1.0, 10.0, 3.0, 1.0]))

    *_, (found, value) = evolve(height, np.full(4, 0.5), 0.1, 60, 12, 0)
    np.testing.assert_allclose(found, top, atol=0.01)
    assert value > -1e-3


def test_it_stays_within_the_bounds():
    *_, (found, _) = evolve(lambda points: points.sum(axis=1), np.full(3, 0.5), 0.2, 40, 10, 0)
    np.testing.assert_allclose(found, 1.0, atol=0.02)


def test_bounds_hold_what_is_shipped():
    for name in ("ppo-track", "ppo-hold-all"):
        gains = teacher_gains(load_train_config(name).imitate.gains)
        shipped = np.array([getattr(gains, key) for key in TEACHER_GAIN_NAMES])
        assert (shipped >= LOW - 1e-6).all()
        assert (shipped <= HIGH + 1e-6).all()


def test_a_teacher_that_steers_the_wrong_way_is_worse():
    trial = Trial("calm", "hold", np.arange(5), 2)
    good, bad = merit(AIMS["hold"], trial, np.stack([row(), row(heading=-3.0)]), 1.0)
    assert good > bad + 0.3
