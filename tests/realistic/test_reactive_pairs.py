"""The reactive tail beside what makes its rate jump: package and generator by their own equations.

The water that a tail carries resists a jump of its rate with an impulse. The generator gives it at
that instant, the package within some 20 ms.
"""

from __future__ import annotations

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.hidden.excitation import exciting, merged
from tests.hidden.simulate import simulate

FISH = load_fish("zheng-2021-a")
TIMES = np.arange(0.0, 12.0, 0.02)
COMMANDS = merged(exciting(25.0, 14.0, "steps", np.random.default_rng(4)))
REACTIVE = {"tail_reactive": {"scale": 0.3}}
SMOOTH = {
    "servo_lag": {"time_constant": 0.03},
    "tail_flexibility": {"natural_frequency": 10.0, "damping_ratio": 0.3},
    "battery_sag": {"rate": 0.002},
}
JUMPING = {
    "servo_backlash": {"gap": 0.03},
    "servo_rate_limit": {"rate": 5.0},
    "tail_asymmetry": {"ratio": 0.2},
}
RATES_HERE, RATES_THERE = slice(10, 13), slice(15, 18)


def rates_here(effects):
    """Body rates (T, 3) of the package."""
    commands = CommandSteps(COMMANDS[:, 0], COMMANDS[:, 1:])
    return (
        Simulator(FISH, dt=0.002, effects=effects)
        .run(commands, sample_times_s=TIMES)
        .states[:, RATES_HERE]
    )


def rates_there(effects):
    """Body rates (T, 3) of the generator."""
    return simulate(FISH.values(), COMMANDS, TIMES, effects)[:, RATES_THERE]


@pytest.mark.parametrize("name", [*SMOOTH, *JUMPING])
def test_what_the_reactive_tail_changes_beside_another_effect(name):
    other = {name: {**SMOOTH, **JUMPING}[name]}
    here, there = rates_here({**other, **REACTIVE}), rates_there({**other, **REACTIVE})
    changed = np.linalg.norm(there - rates_there(other))
    largest = 0.35 if name in JUMPING else 1e-4
    assert np.linalg.norm(here - there) < largest * changed
