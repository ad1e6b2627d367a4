"""The likelihood is smooth in parameters, also where a limit makes the tail's rate jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.series import SeriesProblem
from fish_env.identification.variation import VARIATIONS
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.simulator import Simulator
from tests.identification.synthetic import ALL, FISH, PATHS, SENSOR_SD, Setup

RATE_LIMIT = EffectParameterId("servo_rate_limit", "rate")
PLAY = EffectParameterId("servo_backlash", "gap")
LIMITS = {RATE_LIMIT: 4.0, PLAY: 0.08}
SCALE = EffectParameterId("frequency_scale", "scale")
FOLLOWERS = {
    EffectParameterId("servo_lag", "time_constant"): 0.05,
    EffectParameterId("tail_flexibility", "natural_frequency"): 5.0,
}
CLOCK_OFFSET = next(i for i, one in enumerate(VARIATIONS) if one.name == "clock_offset")
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


def following(follower: EffectParameterId) -> tuple[SeriesProblem, Point, NoiseModel]:
    """A run of a tail that follows its command, at the truth, and noise that leaves its phase."""
    values = {follower: FOLLOWERS[follower]}
    problem = SeriesProblem(swum(follower, values[follower]), paths=PATHS)
    point = Point(problem.start.z, {**problem.beginning([follower.effect]), **values})
    return problem, point, replace(Setup().noise, phase_sd=0.1)


@pytest.mark.parametrize("follower", FOLLOWERS, ids=lambda follower: follower.effect)
def test_it_does_not_matter_on_which_side_of_a_sample_a_command_jumps(follower):
    """What follows the tail's phase follows that which it had before the jump, and not the jump.

    Taken from its rate in time, which a jump makes fast, the likelihood leapt by thousands where
    clocks differ by nothing.
    """
    problem, point, noise = following(follower)

    def value(offset: float) -> float:
        numbers = np.zeros_like(problem.variation)
        numbers[:, CLOCK_OFFSET] = offset
        moved = problem.with_variation(numbers, point, noise)
        return -2.0 * sum(run.log_likelihood for run in moved.filtered(point, noise))

    before, at, after = (value(offset) for offset in (-3e-5, 0.0, 3e-5))
    assert abs(before - at) < 0.2
    assert abs(after - at) < 0.2


@pytest.mark.parametrize("follower", FOLLOWERS, ids=lambda follower: follower.effect)
def test_lanes_of_a_tail_that_follows_repeat_its_filter(follower):
    """Also just after jumps, where each lane's own rates would tell another story."""
    problem, point, noise = following(follower)
    (filtered,) = problem.filtered(point, noise)
    lanes = {id: np.full(2, value) for id, value in point.effects.items()}
    untold = replace(filtered, turns=filtered.turns[:, :0])
    rows, astray = (
        problem.innovations(np.zeros((len(PATHS), 2)), lanes, noise, [gains])
        for gains in (filtered, untold)
    )
    for row in rows:
        np.testing.assert_allclose(row, filtered.residuals, atol=1e-6)
    assert np.abs(astray[0] - filtered.residuals).max() > 0.1
