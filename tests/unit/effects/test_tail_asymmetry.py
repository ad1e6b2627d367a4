"""An asymmetric tail: half strokes, their rate, and the kink where they meet."""

import numpy as np
import pytest

from fish_env.effects import get_effect
from fish_env.effects.tail_asymmetry import stretch_half_strokes
from fish_env.model.jit import py_function
from fish_env.model.records import Inputs
from fish_env.model.tail import commanded_tail
from tests.unit.effects.support import run, tail

RATIO = 0.2
EFFECTS = {"tail_asymmetry": {"ratio": RATIO}}
SWING = [{"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.3, "tail_frequency": 1.0}]


def tail_at(phase, ratio=RATIO, **changes):
    """The asymmetric tail at a phase, from the hook itself."""
    inputs = Inputs(0.1, 0.3, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)._replace(**changes)
    given = py_function(commanded_tail)(inputs, phase)
    own = get_effect("tail_asymmetry").record_type(ratio)
    side = 1.0 if np.sin(phase) > 0.0 else -1.0
    return py_function(stretch_half_strokes)(given, inputs, phase, 0.0, None, own, (side,), 0.0)[0]


def test_each_half_stroke_has_its_own_amplitude():
    """A1 (1 + ratio) to the positive side of the offset, A1 (1 - ratio) to the other."""
    beat = run(EFFECTS, SWING, rate_hz=400)
    angle, _ = tail(EFFECTS, beat)
    assert angle.max() == pytest.approx(0.1 + 0.36, abs=1e-4)
    assert angle.min() == pytest.approx(0.1 - 0.24, abs=1e-4)
    swing = np.sin(beat["tail_phase"])
    expected = 0.1 + np.where(swing > 0, 0.36, 0.24) * swing
    np.testing.assert_allclose(angle, expected, atol=1e-12)


def test_the_rate_is_the_derivative_of_the_angle():
    """Also while the amplitude slews."""
    for phase in (0.4, 2.0, 3.5, 5.9):
        ahead, behind = (
            tail_at(phase + 2 * np.pi * s, tail_amplitude=0.3 + 0.5 * s).angle
            for s in (1e-5, -1e-5)
        )
        rate = tail_at(phase, tail_amplitude_rate=0.5).rate
        assert rate == pytest.approx((ahead - behind) / 2e-5, rel=1e-6)


def test_the_acceleration_integrates_to_the_rate_over_the_kinks():
    """The pulses around both kinks hold the whole jump: no net impulse is left over a beat."""
    phases = np.linspace(0.0, 2 * np.pi, 20001)
    tails = [tail_at(phase) for phase in phases]
    gained = np.trapezoid([x.acceleration for x in tails], phases / (2 * np.pi))
    assert gained == pytest.approx(0.0, abs=1e-4)
    half = slice(5000, 15001)  # from one stroke's end to the other's, over one kink
    gained = np.trapezoid([x.acceleration for x in tails[half]], phases[half] / (2 * np.pi))
    assert gained == pytest.approx(tails[15000].rate - tails[5000].rate, abs=2e-3)


def test_a_coarse_step_does_not_miss_the_kink():
    """It would, by a quarter of the turn, if the rate jumped."""
    swim = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]
    coarse, fine, without = (
        run(effects, swim, 4.0, dt=dt)["yaw"][-1]
        for effects, dt in ((EFFECTS, 0.01), (EFFECTS, 0.001), (None, 0.01))
    )
    assert coarse - without == pytest.approx(fine - without, rel=0.02)


def test_mirroring_the_ratio_mirrors_the_stroke():
    """Half a beat later, to the other side."""
    one, two = tail_at(0.7), tail_at(0.7 + np.pi, ratio=-RATIO)
    assert one.angle - 0.1 == pytest.approx(0.1 - two.angle)
    assert one.rate == pytest.approx(-two.rate)
    assert one.acceleration == pytest.approx(-two.acceleration)


def test_a_straight_swimmer_turns():
    """More the faster it swims, unlike a bias."""
    swim = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]
    turned = run(EFFECTS, swim, 6.0)["yaw"]
    mirrored = run({"tail_asymmetry": {"ratio": -RATIO}}, swim, 6.0, tail_phase=np.pi)["yaw"]
    assert abs(turned[-1]) > 0.1
    np.testing.assert_allclose(mirrored, -turned, atol=1e-4)
