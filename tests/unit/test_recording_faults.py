"""Coarse digits of a body at rest are no stuck sensor; a sensor that stays while it moves is."""

import numpy as np
import pytest

from fish_env.errors import DatasetError
from fish_env.rigidbody.recording import RecordedRun
from fish_env.rigidbody.recording_faults import check_stuck

TIME = np.arange(750) * 0.04
REST_S = 1.4
NOISE, DIGIT = 0.013, 0.04


def turning(digit: float, still_s: float) -> RecordedRun:
    """A rate that is noise at first, then swings; written in digits of some size."""
    rng = np.random.default_rng(0)
    swing = np.where(TIME < REST_S, 0.0, 0.4 * np.cos(9.0 * (TIME - REST_S)))
    noise = NOISE * rng.standard_normal(len(TIME)).clip(-1.4, 1.4)
    rate = np.round((swing + noise) / digit) * digit
    return RecordedRun(
        "r1", TIME, {"r": rate}, np.zeros(0), still_s=np.array([[0.0, still_s]])
    )  # fmt: skip


def test_coarse_digits_of_a_body_at_rest_are_no_fault():
    check_stuck("pool: run r1", turning(DIGIT, REST_S), "r")


def test_the_same_row_is_a_fault_while_something_drives_the_body():
    with pytest.raises(DatasetError, match=r"r is stuck at -?0 for 3\d samples in a row"):
        check_stuck("pool: run r1", turning(DIGIT, 0.2), "r")


def test_a_sensor_that_stays_in_the_finest_digits_is_a_fault_at_rest_too():
    run = turning(1e-9, REST_S)
    run.channels["r"][3:30] = 0.5
    with pytest.raises(DatasetError, match="27 samples in a row"):
        check_stuck("pool: run r1", run, "r")
