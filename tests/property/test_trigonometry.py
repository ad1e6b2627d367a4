"""Branch-free sine, cosine and exponential against the library's."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fish_env.model.jit import py_function
from fish_env.model.trigonometry import exponential, sincos

SINCOS, EXPONENTIAL = py_function(sincos), py_function(exponential)
ULP = np.finfo(float).eps


@given(angle=st.floats(-1e6, 1e6))
def test_sine_and_cosine_are_exact_to_the_last_place_of_one(angle):
    """Wherever a tail phase may get: a million radians is a day of fast beating."""
    sine, cosine = SINCOS(angle)
    assert abs(sine - math.sin(angle)) <= 1.1 * ULP
    assert abs(cosine - math.cos(angle)) <= 1.1 * ULP


@pytest.mark.parametrize("quarter", [*range(-9, 10), 10**5, -(10**5) + 1])
def test_sine_and_cosine_at_and_beside_quarter_turns(quarter):
    """Where the reduction changes its quadrant."""
    for angle in (quarter * math.pi / 2, (quarter + 0.5) * math.pi / 2):
        for nearby in (np.nextafter(angle, -np.inf), angle, np.nextafter(angle, np.inf)):
            sine, cosine = SINCOS(float(nearby))
            assert sine == pytest.approx(math.sin(nearby), abs=1.1 * ULP)
            assert cosine == pytest.approx(math.cos(nearby), abs=1.1 * ULP)


def test_a_still_tail_is_exactly_straight():
    assert SINCOS(0.0) == (0.0, 1.0)


@given(angle=st.floats(-1e5, 1e5))
def test_sine_is_odd_and_cosine_even_to_the_last_bit(angle):
    """A mirrored fish must not drift off its mirror image by rounding."""
    sine, cosine = SINCOS(angle)
    assert SINCOS(-angle) == (-sine, cosine)


@given(x=st.floats(-30.0, 30.0))
def test_the_exponential_is_exact_to_a_trillionth(x):
    assert EXPONENTIAL(x) == pytest.approx(math.exp(x), rel=2e-12)


def test_the_exponential_of_zero_is_one_and_it_stays_within_its_ends():
    assert EXPONENTIAL(0.0) == 1.0
    assert EXPONENTIAL(-1e9) == EXPONENTIAL(-30.0)
    assert EXPONENTIAL(1e9) == EXPONENTIAL(30.0)


def test_the_compiled_functions_are_the_same_ones():
    """Sampled over their ranges, to the last bit."""
    for angle in np.linspace(-1e4, 1e4, 500):
        assert sincos(angle) == SINCOS(angle)
    for x in np.linspace(-30, 30, 500):
        assert exponential(x) == EXPONENTIAL(x)
