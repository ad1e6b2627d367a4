"""Effects that make the tail's rate jump: what they push adds up, wherever in a step it jumps."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.effects import get_effect
from fish_env.model import corners
from fish_env.model.jit import py_function
from fish_env.model.records import Tail


def gain_of_the_rate(effect, setting, step, seconds=6.0):
    """Median error (rad) of a rate summed with Runge-Kutta's weights, against the angle's gain."""
    settings = SimpleNamespace(**setting)

    def stage(time, since, memory):
        phase = 2 * np.pi * 1.3 * time
        omega = 2 * np.pi * 1.3
        told = Tail(0.4 * np.sin(phase), 0.4 * omega * np.cos(phase), 0.0)
        told = told._replace(acceleration=-(omega**2) * told.angle)
        hook = py_function(effect.hooks["tail"])
        seen, _, after = hook(told, None, None, time, None, settings, (0.0,), memory, since)
        return seen, after

    first = Tail(0.0, 0.4 * 2 * np.pi * 1.3, 0.0)
    (_, *memory) = py_function(effect.initial_states)(None, first, None, settings)
    begin, summed, errors = memory[0], 0.0, []
    for time in np.arange(0.0, seconds, step):
        parts = [stage(time + share * step, share * step, tuple(memory)) for share in (0, 0.5, 1)]
        summed += step * np.dot([part[0].rate for part in parts], [1, 4, 1]) / 6
        memory = parts[-1][1]
        errors.append(summed - (parts[-1][0].angle - begin))
    return np.median(np.abs(errors))


@pytest.mark.parametrize(
    ("name", "follows", "setting"),
    [
        ("servo_backlash", "fish_env.effects.servo_backlash", {"gap": 0.06}),
        ("servo_rate_limit", "fish_env.model.servo", {"rate": 2.0}),
    ],
)
def test_the_rate_adds_up_to_the_angle_wherever_it_jumps(name, follows, setting, monkeypatch):
    """Within a step too; the rate of the moment alone would be off by ten times as much."""
    effect = get_effect(name)
    right = gain_of_the_rate(effect, setting, 0.0025)
    assert right < 5e-5
    own, module = import_module(f"fish_env.effects.{name}"), import_module(follows)
    if own is not module:
        monkeypatch.setattr(own, "chase", py_function(own.chase))
    monkeypatch.setattr(module, "follow", py_function(corners.follow))
    monkeypatch.setattr(corners, "window", lambda tail, since, *_: (since, since + 1e-6, 0.0))
    assert gain_of_the_rate(effect, setting, 0.0025) > 10 * right
