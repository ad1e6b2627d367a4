"""What acts between command and tail, two and three at once: package and generator agree.

Both remember angles from step to step, each in its own way, so that an angle that one of several
hands on too early or too late shows here and in no comparison of single effects.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.hidden.excitation import exciting, merged
from tests.hidden.simulate import simulate

FISH = load_fish("zheng-2021-a")
TIMES = np.arange(0.0, 8.0, 0.04)
COMMANDS = merged(exciting(25.0, 10.0, "steps", np.random.default_rng(5)))
CHAIN = {
    "servo_delay": {"delay": 0.05},
    "angle_limit": {"lower": -0.45, "upper": 0.35},
    "servo_rate_limit": {"rate": 3.7},
    "servo_backlash": {"gap": 0.07},
    "battery_sag": {"rate": 0.003},
    "tail_gain": {"gain": 0.87},
}
SEVERAL = [*combinations(CHAIN, 2), ("servo_delay", "servo_rate_limit", "servo_backlash")]
PATH_M, YAW_RATE = 1e-4, 2e-3
"""Largest differences (m, rad/s): the generator's steps of 0.5 ms leave a fifth of that."""


def here(effects):
    """Position and yaw rate (T, 4) of the package."""
    commands = CommandSteps(COMMANDS[:, 0], COMMANDS[:, 1:])
    run = Simulator(FISH, effects=effects).run(commands, sample_times_s=TIMES)
    return run.states[:, [0, 1, 2, 12]]


def there(effects):
    """The same of the generator."""
    states = simulate(FISH.values(), COMMANDS, TIMES, effects, longest=5e-4)
    return states[:, [0, 1, 2, 17]]


def differences(effects):
    """Largest differences of position (m) and yaw rate (rad/s)."""
    apart = np.abs(here(effects) - there(effects)).max(axis=0)
    return apart[:3].max(), apart[3]


@pytest.mark.parametrize("names", SEVERAL, ids="-".join)
def test_both_pass_the_command_through_the_same_chain(names):
    path, yaw_rate = differences({name: CHAIN[name] for name in names})
    assert path < PATH_M
    assert yaw_rate < YAW_RATE


def test_another_order_would_show():
    """A lag that the generator puts behind the play, and the package before it."""
    path, yaw_rate = differences(
        {"servo_lag": {"time_constant": 0.04}, "servo_backlash": CHAIN["servo_backlash"]}
    )
    assert path > PATH_M
    assert yaw_rate > YAW_RATE
