"""The commanded tail: its rate and acceleration are the derivatives of its angle."""

import numpy as np
import pytest

from fish_env.model.records import Inputs
from fish_env.model.tail import commanded_tail
from tests.broken import plain


def test_rate_and_acceleration_are_derivatives_while_every_actuator_slews():
    """Offset, amplitude and frequency ramp together; the phase integrates the frequency."""
    tail_of = plain(commanded_tail, {})
    offset, amplitude, frequency = (0.1, 0.7), (0.3, -0.9), (1.5, 4.0)

    def tail(t):
        now = [base + slope * t for base, slope in (offset, amplitude, frequency)]
        phase = 0.4 + 2 * np.pi * (frequency[0] * t + 0.5 * frequency[1] * t**2)
        return tail_of(Inputs(*now, 0.0, 0.0, 0.7, -0.9, 4.0, 0.0, 0.0), phase)

    h = 1e-5
    for t in (0.0, 0.13, 0.4):
        before, now, after = tail(t - h), tail(t), tail(t + h)
        assert now.rate == pytest.approx((after.angle - before.angle) / (2 * h), rel=1e-7)
        assert now.acceleration == pytest.approx((after.rate - before.rate) / (2 * h), rel=1e-6)
