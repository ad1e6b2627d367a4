"""A flexible tail against second-order theory."""

import numpy as np
import pytest

from fish_env.effects import get_effect
from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import run, tail

NATURAL, ZETA = 4.0, 0.3
EFFECTS = {"tail_flexibility": {"natural_frequency": NATURAL, "damping_ratio": ZETA}}


@pytest.mark.parametrize("frequency", [1.0, 4.0, 6.0])
def test_gain_and_phase_are_those_of_a_second_order_system(frequency):
    """1 / (1 - s^2 + 2 i zeta s), s = f / natural_frequency: it overshoots near resonance."""
    swing = [{"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.2, "tail_frequency": frequency}]
    settled = np.ceil(3.0 * frequency) / frequency
    times = settled + np.arange(65) / (64 * frequency)
    simulator = Simulator(swimmer(), 0.002, EFFECTS)
    swim = simulator.run(swing, sample_times_s=np.concatenate([[0.0], times]))
    angle = simulator.outputs(swim)["tail_angle"][1:-1]
    response = 2j * np.mean(angle * np.exp(-2j * np.pi * frequency * times[:-1])) / 0.2
    ratio = frequency / NATURAL
    assert response == pytest.approx(1 / (1 - ratio**2 + 2j * ZETA * ratio), abs=1e-5)
    assert np.mean(angle) == pytest.approx(0.1, abs=1e-6)


def test_a_step_rings_at_the_damped_frequency():
    """1 - exp(-zeta w t) (cos(wd t) + zeta w / wd sin(wd t))."""
    step = run(EFFECTS, [{"t": 0.0}, {"t": 0.1, "tail_offset": 0.3}], 1.0, dt=0.002)
    t = np.maximum(step.time_s - 0.1, 0.0)
    omega = 2 * np.pi * NATURAL
    damped = omega * np.sqrt(1 - ZETA**2)
    wave = np.cos(damped * t) + ZETA * omega / damped * np.sin(damped * t)
    expected = 0.3 * (1 - np.exp(-ZETA * omega * t) * wave)
    np.testing.assert_allclose(tail(EFFECTS, step)[0], expected, atol=1e-5)


def test_it_starts_with_the_tail_unbent_and_at_rest():
    """At the angle that is commanded then; the first stroke sets it in motion."""
    start = run(EFFECTS, rate_hz=1000, seconds=0.01)
    angle, rate = tail(EFFECTS, start)
    assert angle[0] == pytest.approx(0.1, abs=1e-12)
    assert rate[0] == 0.0


def test_the_longest_step_follows_the_faster_eigenvalue():
    """Overdamped, one of the two is faster than the natural frequency."""
    longest = get_effect("tail_flexibility").time_scale
    omega = 2 * np.pi * 5.0
    assert longest({"natural_frequency": 5.0, "damping_ratio": 0.5}) == pytest.approx(1 / omega)
    fast = omega * (2.0 + np.sqrt(3.0))
    assert longest({"natural_frequency": 5.0, "damping_ratio": 2.0}) == pytest.approx(1 / fast)
    assert longest({"natural_frequency": np.inf, "damping_ratio": 0.3}) == np.inf
    stiff = Simulator(swimmer(), 0.01, {"tail_flexibility": {"natural_frequency": 30.0}})
    assert stiff.dt <= 1 / (2 * np.pi * 30.0)
    Simulator(swimmer(), 0.05, {"tail_flexibility": {"damping_ratio": 0.3}})


@pytest.mark.parametrize(("natural", "zeta", "part"), [(7.9, 1.49, 0.02), (4.0, 1.0, 0.15)])
def test_overdamped_it_is_a_lag_and_nearly_a_delay(natural, zeta, part):
    """The tail then beats as with both, but for a part of what it is late."""
    values = {"natural_frequency": natural, "damping_ratio": zeta}
    parts = get_effect("tail_flexibility").in_parts(values)
    assert set(parts) == {"servo_lag", "servo_delay"}
    bent, apart, stiff = (
        tail(effects, run(effects, seconds=3.0, dt=0.002))[0][50:]
        for effects in ({"tail_flexibility": values}, parts, {})
    )
    assert np.abs(bent - apart).max() < part * np.abs(bent - stiff).max()


def test_what_rings_is_no_lag():
    assert not get_effect("tail_flexibility").in_parts(EFFECTS["tail_flexibility"])
    assert not get_effect("tail_flexibility").in_parts(get_effect("tail_flexibility").neutral)


def test_a_stiff_tail_is_late_and_nothing_else():
    """As its declaration says: beats do not reach its resonance. A tail that bends is no lag."""
    flexible = get_effect("tail_flexibility")
    values = {"natural_frequency": 16.0, "damping_ratio": 0.5}
    limit = flexible.in_parts(values)
    assert [*limit] == ["servo_lag"]
    beat = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 1.5}]
    late, lag, plain = (
        tail(own, run(own, beat, 3.0, rate_hz=200, dt=0.002))[0]
        for own in ({"tail_flexibility": values}, limit, {})
    )
    assert np.abs(late - lag)[300:].max() < 0.15 * np.abs(late - plain)[300:].max()
    assert flexible.in_parts({**values, "natural_frequency": 6.0}) == {}
