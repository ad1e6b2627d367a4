"""A measured tail angle is evidence: of the servo, of the beat and of the phase at the start."""

import numpy as np
import pytest

from fish_env import Simulator
from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification import SeriesProblem, fit
from fish_env.identification.channels import TABLE, usable_channels
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point

FISH = "zheng-2021-a"
LAG = {"servo_lag": {"time_constant": 0.06}}
SD = {"x": 0.0015, "y": 0.0015, "yaw": 0.004, "tail_angle": 0.002}
PATHS = ("tail.drag.c2", "body.plane_xy.drag.c0")


def record(effects=LAG, channels=tuple(SD), seed=0, phase=0.0, known=True):
    """One run of 12 s with switching commands, as an overhead camera and a tail encoder see it."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 12.0, 0.04)
    switches = np.arange(0.0, 12.0, 2.0)
    values = rng.uniform([-0.3, 0.25, 1.0, 0.0, 0.0], [0.3, 0.5, 2.0, 0.0, 0.0], (6, 5))
    steps = CommandSteps(switches, values)
    simulator = Simulator(FISH, 0.005, effects=effects)
    swum = simulator.run(steps, sample_times_s=times, initial=None)
    true = {**swum.channels, "tail_angle": simulator.outputs(swum)["tail_angle"]}
    shown = {n: true[n] + SD[n] * rng.standard_normal(len(times)) for n in channels}
    start = ("rest", phase) if known else ("unknown", None)
    run = Run("r1", times, shown, steps, *start)
    return Dataset("encoder", FISH, (run,), {n: SD[n] for n in channels})


def lag_of(dataset):
    problem = SeriesProblem(dataset, paths=PATHS, effects=["servo_lag"])
    start = Point(np.zeros(len(PATHS)), {EffectParameterId("servo_lag", "time_constant"): 0.03})
    return fit(problem, start=start)


def test_the_tail_angle_is_a_channel_of_the_filter():
    assert usable_channels(("tail_angle", "yaw", "x")) == ("x", "yaw", "tail_angle")


def test_every_channel_of_the_table_has_its_own_name_and_a_unit():
    assert len({channel.name for channel in TABLE}) == len(TABLE)
    assert {channel.unit for channel in TABLE} == {"m", "rad", "m/s", "rad/s"}


def test_a_tail_angle_that_the_model_explains_leaves_white_residuals():
    own = lag_of(record())
    column = own.problem.channels.index("tail_angle")
    seen = np.concatenate([f.innovations[10:, column] for f in own.filtered])
    assert np.sqrt(np.mean(seen**2)) == pytest.approx(1.0, abs=0.15)


def test_it_tells_a_servo_lag_far_better_than_the_camera_alone():
    path = EffectParameterId("servo_lag", "time_constant")
    low, high = lag_of(record()).interval(path)
    assert low < 0.06 < high
    alone = lag_of(record(channels=("x", "y", "yaw"))).interval(path)
    assert high - low < 0.4 * (alone[1] - alone[0])


def test_it_settles_a_phase_that_the_record_does_not_tell():
    problem = SeriesProblem(record(effects={}, known=False), paths=PATHS)
    settled = problem.settled(problem.start, problem.default_noise())
    assert np.cos(settled.runs[0].state0[13]) == pytest.approx(1.0, abs=0.01)


def test_slopes_of_the_likelihood_follow_the_phase():
    problem = SeriesProblem(record(), paths=PATHS)
    (own,) = problem.filtered(problem.start, problem.default_noise(), keep_slopes=True)
    column = problem.channels.index("tail_angle")
    slopes = own.slopes.channels[20:, column]
    commands = problem.runs[0].command_values
    assert np.abs(slopes[:, -1]).max() == pytest.approx(commands[:, 1].max(), rel=0.3)
    assert not slopes[:, :-1].any()
