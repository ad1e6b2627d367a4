"""From actions to motion: mapping, slew limits, delay, and the same physics as the simulator."""

import numpy as np
import pytest

from fish_env.envs.config import load_env_config
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.model.state import INPUTS
from tests.conformance import checkers
from tests.conformance.cases import IDEAL, START, random_actions, run, table

UNITS = {"rad": 1.0, "Hz": 1.0, "mm": 0.001, "rad/s": 1.0, "Hz/s": 1.0, "mm/s": 0.001}


def quantity(text: str) -> float:
    """A number of the docstring's table in SI."""
    number, *unit = text.split()
    return float(number) * UNITS[unit[0] if unit else "rad"]


def test_the_docstring_says_what_the_settings_are():
    """The table of actions: names, ranges and slew limits as in the file."""
    config = load_env_config()
    rows = table("Action space")
    assert [int(row[0]) for row in rows] == list(range(5))
    for row, name in zip(rows, INPUTS, strict=True):
        assert row[1].startswith(name.replace("_", " "))
    for column, values in ((2, config.low), (3, config.high), (4, config.slew)):
        np.testing.assert_allclose([quantity(row[column]) for row in rows], values, rtol=1e-12)


@pytest.mark.parametrize("level", [-1.0, -0.3, 0.0, 0.75, 1.0])
def test_actions_map_linearly_to_the_ranges(level):
    """-1 is the low end, +1 the high end, values beyond are clipped; ideal actuators are there."""
    env = RoboticFish3DEnv(config=IDEAL)
    config = env.options.config
    env.reset(seed=0, options=START)
    obs, *_ = env.step(np.full(5, level, np.float32))
    level32 = float(np.float32(level))
    np.testing.assert_allclose(
        env.actuators, config.low + (level32 + 1) / 2 * (config.high - config.low), atol=1e-16
    )
    np.testing.assert_array_equal(obs[28:], np.full(5, level, np.float32))
    np.testing.assert_allclose(obs[23:28], level, atol=1e-7)
    obs, *_ = env.step(np.full(5, 50.0 * level, np.float32))
    np.testing.assert_array_equal(obs[28:], np.clip(np.full(5, 50.0 * level), -1, 1))


def test_actuators_ramp_at_their_slew_limits_and_stop_on_target():
    """After each control step: towards the target by at most slew x period, never beyond."""
    checkers.check_slew(RoboticFish3DEnv)


def test_a_ramp_within_a_control_step_is_met_substep_by_substep():
    """At the physics rate too: equal steps, a last shorter one, then rest."""
    env = RoboticFish3DEnv(control_hz=100.0)
    env.reset(seed=0, options=START)
    seen = []
    for _ in range(10):
        env.step(np.array([0.2, -1, -1, 0, 0], np.float32))
        seen.append(env.actuators[0])
    target = float(np.float32(0.2)) * 0.6
    np.testing.assert_allclose(seen, np.minimum(0.02 * np.arange(1, 11), target), atol=1e-15)
    assert seen[-1] == pytest.approx(target, abs=1e-17)


WATER = {
    "effects": {"servo_lag": {"time_constant": 0.06}, "servo_delay": {"delay": 0.08}},
    "current": (0.05, -0.08, 0.02),
    "wave": {"amplitude": 0.03, "frequency": 0.8, "phase": 0.5, "heading": 0.7},
}


@pytest.mark.parametrize("options", [{}, WATER, {"fish": "zheng-2021-b"}], ids=str)
def test_the_environment_swims_like_the_simulator(options):
    """Ideal actuators and one schedule: the same states to 1e-12, effects included."""
    checkers.check_physics(RoboticFish3DEnv, options)


@pytest.mark.parametrize("delay", [0.01, 0.07, 0.1, 0.13, 0.4])
def test_an_action_acts_exactly_its_delay_later(delay):
    """The simulator's schedule shifted by the delay gives the same states, to the substep."""
    checkers.check_action_delay(RoboticFish3DEnv, delay)


def test_before_a_delayed_action_arrives_the_actuators_rest():
    """The first actions of an episode do not see those of the episode before."""
    env = RoboticFish3DEnv(action_delay_s=0.3)
    run(env, np.ones((20, 5), np.float32), **START)
    rest = env.reset(seed=0, options=START)[0]
    for _ in range(3):
        obs, *_ = env.step(np.ones(5, np.float32))
        np.testing.assert_array_equal(obs[23:28], rest[23:28])
        np.testing.assert_array_equal(obs[28:], 1.0)
    assert np.all(env.step(np.ones(5, np.float32))[0][23:28] > rest[23:28])


@pytest.mark.parametrize(("config", "largest", "ratio"), [(IDEAL, 1e-5, 10.0), (None, 1e-3, 1.8)])
def test_finer_physics_gives_the_same_motion(config, largest, ratio):
    """To RK4's order with ideal actuators; ramps that end within a physics step cost some of it."""
    actions = random_actions(30, seed=2)
    ends = []
    for hz in (100.0, 200.0, 800.0):
        env = RoboticFish3DEnv(physics_hz=hz, config=config)
        run(env, actions, **START)
        ends.append(np.array(list(env.state.values()))[:14])
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert coarse < largest
    assert fine < coarse / ratio


def test_control_and_physics_rates_can_be_set():
    """20 Hz control with each action held twice is 10 Hz control; the clock and fps follow."""
    actions = random_actions(30, seed=2)
    slow, fast = RoboticFish3DEnv(), RoboticFish3DEnv(control_hz=20.0)
    run(slow, actions, **START)
    _, _, infos = run(fast, np.repeat(actions, 2, axis=0), **START)
    assert fast.state == slow.state
    assert infos[-1]["time_s"] == 3.0
    assert fast.metadata["render_fps"] == pytest.approx(20.0)


def test_time_is_a_number_of_steps_times_the_step():
    """Rounding does not add up: after a thousand steps the clock is exact."""
    env = RoboticFish3DEnv()
    _, _, infos = run(env, np.zeros((1000, 5), np.float32))
    period = env.options.config.control_period
    assert [info["time_s"] for info in infos] == [i * period for i in range(1001)]
