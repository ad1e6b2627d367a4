"""The script that tunes the PID finds gains within its bounds, and keeps off the suites' seeds."""

from dataclasses import asdict

import pytest

from robofish_agents.controllers.pid import GAIN_NAMES, load_gains, tuned_gains
from robofish_agents.evaluation.suites import RESERVED_SEEDS
from scripts import tune_pid


@pytest.mark.slow
def test_it_writes_gains_that_the_controller_reads(tmp_path):
    file = tmp_path / "pid.yaml"
    sizes = ["--generations", "1", "--candidates", "5", "--episodes", "1", "--check", "1"]
    tune_pid.main([*sizes, "--out", str(file)])
    for name, value in asdict(load_gains(file)).items():
        low, high = tune_pid.BOUNDS[name]
        assert low <= value <= high


def test_every_gain_has_bounds_around_the_shipped_one():
    assert set(tune_pid.BOUNDS) == set(GAIN_NAMES)
    for name, value in asdict(tuned_gains()).items():
        low, high = tune_pid.BOUNDS[name]
        assert low <= value <= high, name


def test_no_episode_of_a_suite_is_tuned_on():
    for first in (tune_pid.FIRST_SEED, tune_pid.CHECK_SEED):
        assert set(range(first, first + 100_000)).isdisjoint(RESERVED_SEEDS)
