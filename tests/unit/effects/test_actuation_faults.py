"""Offset gain, swing loss, end stops and a loaded beat: each is another command."""

import numpy as np
import pytest

from fish_env.effects import get_effect
from fish_env.model.records import Inputs
from tests.unit.effects.support import assert_same_motion, run, tail

TURN = {"t": 0.0, "tail_offset": 0.3, "tail_amplitude": 0.3, "tail_frequency": 2.0}


def told(**changes):
    return [{**TURN, **changes}]


def test_an_offset_gain_is_another_offset():
    gained = run({"offset_gain": {"gain": 0.6}}, told(), 2.0)
    assert_same_motion(gained, run(None, told(tail_offset=0.18), 2.0))
    assert np.abs(gained["yaw"] - run(None, told(), 2.0)["yaw"]).max() > 0.01


@pytest.mark.parametrize("offset", [0.4, -0.4])
def test_a_swing_loss_is_another_amplitude(offset):
    """Alike on both sides, and no swing is left beyond 1 / per_radian."""
    lost = run({"swing_loss": {"per_radian": 0.5}}, told(tail_offset=offset), 2.0)
    less = told(tail_offset=offset, tail_amplitude=0.3 * 0.8)
    assert_same_motion(lost, run(None, less, 2.0))
    none = run({"swing_loss": {"per_radian": 2.0}}, told(tail_offset=0.6), 1.0)
    still = told(tail_offset=0.6, tail_amplitude=0.0)
    assert_same_motion(none, run(None, still, 1.0))


def test_a_swing_loss_follows_the_offset_that_is_reached():
    """With an offset gain, the loss is that of the scaled offset."""
    both = {"swing_loss": {"per_radian": 0.5}, "offset_gain": {"gain": 0.5}}
    other = told(tail_offset=0.15, tail_amplitude=0.3 * (1 - 0.075))
    assert_same_motion(run(both, told(), 2.0), run(None, other, 2.0))


def test_a_loaded_beat_is_another_frequency():
    loaded = run({"beat_load": {"offset": 0.25, "load": 0.02}}, told(), 2.0)
    left = (1 - 0.25 * 0.3) * (1 - 0.02 * 2 * np.pi * 0.3 * 2.0)
    assert_same_motion(loaded, run(None, told(tail_frequency=2.0 * left), 2.0), atol=1e-9)


SIDE = {"side_load": {"swing": 0.2, "beat": 0.05}}


@pytest.mark.parametrize("offset", [0.6, -0.3, 0.05])
def test_a_side_load_is_another_stroke(offset):
    """Alike on both sides, and the same at any offset well beyond 0.1 rad."""
    share = np.tanh(abs(offset) / 0.1)
    assert share > 0.99 or abs(offset) < 0.1
    stroke = {"tail_amplitude": 0.3 * (1 - 0.2 * share), "tail_frequency": 2 * (1 - 0.05 * share)}
    loaded = run(SIDE, told(tail_offset=offset), 2.0)
    assert_same_motion(loaded, run(None, told(tail_offset=offset, **stroke), 2.0), atol=1e-9)


def test_a_stroke_about_the_centre_has_no_side_load():
    straight = told(tail_offset=0.0)
    assert_same_motion(run(SIDE, straight, 2.0), run(None, straight, 2.0), atol=0.0)


def test_a_side_load_that_sets_in_has_the_rates_of_its_stroke():
    """Rates of amplitude and frequency are the slopes of both while the offset slews."""
    effect = get_effect("side_load")
    values = effect.record_type(**SIDE["side_load"])
    rest = Inputs(*np.zeros(10))

    def loaded(time):
        slewed = rest._replace(
            tail_offset=0.1 - 0.5 * time, tail_offset_rate=-0.5, tail_amplitude=0.3 + time,
            tail_amplitude_rate=1.0, tail_frequency=2.0 - time, tail_frequency_rate=-1.0,
        )  # fmt: skip
        return effect.hooks["inputs"](slewed, time, None, values)

    before, now, after = loaded(-1e-5), loaded(0.0), loaded(1e-5)
    for name in ("tail_amplitude", "tail_frequency"):
        slope = (getattr(after, name) - getattr(before, name)) / 2e-5
        assert getattr(now, f"{name}_rate") == pytest.approx(slope, abs=1e-8)


STOPS = {"angle_limit": {"lower": -0.2, "upper": 0.25}}


def test_stops_hold_the_tail():
    """The commanded angle within them, each stop beyond, at rest there."""
    beat = run(STOPS, told(tail_offset=0.05), 1.0, rate_hz=400)
    angle, rate = tail(STOPS, beat)
    command = 0.05 + 0.3 * np.sin(beat["tail_phase"])
    np.testing.assert_allclose(angle, np.clip(command, -0.2, 0.25), atol=1e-12)
    far = (command > 0.26) | (command < -0.21)
    assert far.any()
    np.testing.assert_array_equal(rate[far], 0.0)


def test_stops_that_are_never_met_do_nothing():
    wide = {"angle_limit": {"lower": -0.8, "upper": 0.8}}
    assert_same_motion(run(wide, told(), 2.0), run(None, told(), 2.0), atol=0.0)


def test_one_stop_turns_the_fish():
    """A tail that cannot go to starboard as far as to port turns a straight swimmer."""
    straight = told(tail_offset=0.0)
    held = run({"angle_limit": {"upper": 0.15}}, straight, 4.0)["yaw"][-1]
    free = run(None, straight, 4.0)["yaw"][-1]
    other = run({"angle_limit": {"lower": -0.15}}, straight, 4.0, tail_phase=np.pi)["yaw"][-1]
    assert abs(held - free) > 0.1
    assert other == pytest.approx(-held, abs=1e-4)


def test_a_coarse_step_does_not_miss_a_stop():
    """The rate jumps within a step; its means over steps add up, forces by its square nearly."""
    coarse, fine, free = (
        run(effects, told(), 4.0, dt=dt)["yaw"][-1]
        for effects, dt in ((STOPS, 0.01), (STOPS, 0.001), (None, 0.01))
    )
    assert coarse - free == pytest.approx(fine - free, rel=0.1)
