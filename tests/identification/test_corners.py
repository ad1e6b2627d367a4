"""The likelihood is smooth in parameters, also where a limit makes the tail's rate jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.series import SeriesProblem
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.simulator import Simulator
from tests.identification.synthetic import ALL, FISH, PATHS, SENSOR_SD, Setup

RATE_LIMIT = EffectParameterId("servo_rate_limit", "rate")
PLAY = EffectParameterId("servo_backlash", "gap")
LIMITS = {RATE_LIMIT: 4.0, PLAY: 0.08}
SCALE = EffectParameterId("frequency_scale", "scale")
STEPS = np.linspace(-1.0, 1.0, 21)


def swum(limit: EffectParameterId, size: float, seconds: float = 10.0) -> Dataset:
    """A run of a fish with a limit, whose commands change every second."""
    rng = np.random.default_rng(0)
    begins, time = np.arange(0.0, seconds, 1.0), np.arange(0.0, seconds, 0.04)
    values = rng.uniform([-0.4, 0.3, 1.2, 0.0, 0.0], [0.4, 0.5, 2.2, 0.0, 0.0], (len(begins), 5))
    names = ("tail_offset", "tail_amplitude", "tail_frequency")
    rows = [
        {"t": begin, **dict(zip(names, row, strict=False))}
        for begin, row in zip(begins.tolist(), values.tolist(), strict=True)
    ]
    fish = Simulator(FISH, 0.0025, {limit.effect: {limit.name: size}})
    swim = fish.run(rows, sample_times_s=time)
    channels = {n: swim[n] + SENSOR_SD[n] * rng.standard_normal(len(time)) for n in ALL}
    run = Run.from_steps("r0", time, channels, CommandSteps(begins, values), start="rest")
    return Dataset("limited", FISH, (run,))


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.effect)
def test_the_likelihood_follows_the_beat_smoothly(limit):
    """About the truth, as far as the data tell it: a quarter of a per cent of the beat.

    With tangents in place of secants for the phase it is rougher by a factor of 30 (500 with play).
    """
    effects = {limit: LIMITS[limit], SCALE: 1.0}
    problem = SeriesProblem(
        swum(limit, LIMITS[limit], 12.0), paths=PATHS, effects=[i.effect for i in effects]
    )
    noise, values = replace(Setup().noise, phase_sd=0.01), []
    for step in STEPS:
        point = Point(problem.start.z, {**effects, SCALE: 1.0 + 0.0025 * step})
        values.append(-2.0 * sum(run.log_likelihood for run in problem.filtered(point, noise)))
    cubic = np.polyval(np.polyfit(STEPS, values, 3), STEPS)
    assert np.ptp(values) > 100.0
    assert np.std(values - cubic) < 0.01 * np.ptp(values)
