"""Two large causes at once, in a generator of its own equations, found beside the nominal fish."""

from __future__ import annotations

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.series import SeriesProblem
from fish_env.inference.afresh import beside_nominal
from fish_env.inference.probes import causes_of
from fish_env.params import load_fish
from tests.hidden.excitation import exciting, merged
from tests.hidden.measurement import ALL_CHANNELS, channels_of
from tests.hidden.simulate import simulate
from tests.identification.synthetic import FISH, SENSOR_SD

HIDDEN = {"tail_reactive": {"scale": 0.5}, "servo_lag": {"time_constant": 0.012}}
OTHERS = ("added_mass", "current", "servo_delay")
RATE_HZ, DURATION_S = 25.0, 10.0


def measured(seed):
    """A run as noisy sensors show it."""
    rng = np.random.default_rng(seed)
    commands = merged(exciting(RATE_HZ, DURATION_S, "steps", rng, 0.0))
    times = np.arange(round(DURATION_S * RATE_HZ)) / RATE_HZ
    true = channels_of(simulate(load_fish(FISH).values(), commands, times, HIDDEN))
    shown = {n: true[n] + SENSOR_SD[n] * rng.standard_normal(len(times)) for n in ALL_CHANNELS}
    return Run(f"r{seed}", times, shown, CommandSteps(commands[:, 0], commands[:, 1:]), "rest", 0.0)


@pytest.fixture(scope="module")
def problem():
    runs = tuple(measured(seed) for seed in range(2))
    return SeriesProblem(Dataset("two causes", FISH, runs, {n: SENSOR_SD[n] for n in ALL_CHANNELS}))


def test_a_reactive_tail_and_a_late_servo_are_found_together(problem):
    causes = [c for c in causes_of(problem) if c.is_effect and c.effect in (*HIDDEN, *OTHERS)]
    found = beside_nominal(problem, causes, lambda step: None)
    assert set(found.causes) == set(HIDDEN)
    estimates = {str(id): value for id, value in found.fit.point.effects.items()}
    assert estimates["effects.tail_reactive.scale"] == pytest.approx(0.5, abs=0.02)
    assert estimates["effects.servo_lag.time_constant"] == pytest.approx(0.012, abs=0.001)
