"""Runs that share their sensor noise count as one; repeats with noise of their own do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.copies import without_copies

BEAT = 2.0 * np.pi * 5.0
"""rad/s. Five samples a beat, which no difference of samples takes out."""
TIMES = np.arange(0.0, 20.0, 0.04)
NOISE = {"x": 2e-3, "r": 0.01}


def swum(id, seed):
    rng = np.random.default_rng(seed)
    motion = {"x": 0.1 * TIMES, "r": 0.3 * np.sin(BEAT * TIMES)}
    channels = {n: motion[n] + sd * rng.standard_normal(len(TIMES)) for n, sd in NOISE.items()}
    return Run(id, TIMES, channels, CommandSteps([0.0], [[0.0, 0.4, 2.0, 0.0, 0.0]]), "rest")


def copied(run, id, share):
    rng = np.random.default_rng(99)
    noisy = {n: a + share * NOISE[n] * rng.standard_normal(len(a)) for n, a in run.channels.items()}
    return replace(run, id=id, channels=noisy)


def dataset(*runs):
    return Dataset("trial", "paper-fish", runs, {})


def test_repeats_of_an_experiment_all_count():
    own = dataset(swum("a", 1), swum("b", 2), swum("c", 3))
    assert without_copies(own) is own


@pytest.mark.parametrize("share", [1e-4, 0.1])
def test_near_copies_count_as_one(share):
    first = swum("a", 1)
    kept = without_copies(dataset(first, copied(first, "b", share), swum("c", 3)))
    assert kept.ids == ("a", "c")
    assert "b has the sensor noise of run a" in kept.notes[-1]


def test_gaps_do_not_hide_a_copy():
    first = swum("a", 1)
    other = copied(first, "b", 0.01)
    gaps = {n: np.where(np.arange(len(a)) % 50 == 7, np.nan, a) for n, a in other.channels.items()}
    assert without_copies(dataset(first, replace(other, channels=gaps))).ids == ("a",)


def test_five_near_copies_leave_one():
    first = swum("a", 1)
    runs = [first, *(copied(first, f"b{i}", 1e-3) for i in range(5))]
    assert without_copies(dataset(*runs)).ids == ("a",)
