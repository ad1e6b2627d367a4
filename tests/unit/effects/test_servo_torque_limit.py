"""A servo that the moment of the water slows down."""

import numpy as np

from fish_env.effects import get_effect
from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import BEAT, assert_same_motion, held, run

TORQUE, SPEED = 0.01, 9.0
WEAK = {"servo_torque_limit": {"torque": TORQUE, "speed": SPEED}}
SWING = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]


def outputs(effects, commands, seconds, fish=None, dt=0.005):
    fish = fish or swimmer()
    way = run(effects, commands, seconds, fish=fish, dt=dt, rate_hz=200.0)
    return way.time_s, Simulator(fish, dt, effects).outputs(way)


def test_a_tail_far_from_its_command_turns_where_motor_and_water_agree():
    """rate = speed (1 - a rate^2 / torque) in still water: the root of a quadratic equation."""
    fish = held()
    turn = [{"t": 0.0}, {"t": 0.1, "tail_offset": 0.7}]
    time, told = outputs(WEAK, turn, 0.35, fish)
    width = 0.5 * fish.get("water.density") * fish.get("tail.area")
    drag = fish.get("tail.drag.c0") + fish.get("tail.drag.c2")
    a = SPEED / TORQUE * width * fish.get("tail.center_of_pressure") ** 3 * drag
    rate = (np.sqrt(1.0 + 4.0 * a * SPEED) - 1.0) / (2.0 * a)
    turning = (time > 0.15) & (time < 0.3)
    assert rate < 0.4 * SPEED
    np.testing.assert_allclose(told["tail_rate"][turning], rate, rtol=2e-3)
    np.testing.assert_allclose(np.ptp(told["tail_angle"][turning]), rate * 0.145, rtol=0.05)


def test_a_swimming_fish_pays_for_each_rate_with_torque():
    """On the line from (0, speed) to (torque, 0), with the moment from the power at the hinge."""
    time, told = outputs(WEAK, SWING, 4.0)
    angle, rate = told["tail_angle"], told["tail_rate"]
    command = 0.35 * np.sin(4.0 * np.pi * time)
    behind = (np.abs(angle - command) > 0.05) & (np.abs(rate) > 0.5) & (time > 1.0)
    assert behind.sum() > 200
    assert np.ptp(angle[time > 1.0]) < 0.6
    resisting = told["tail_power"][behind] / np.abs(rate[behind])
    wanted = SPEED * (1.0 - resisting / TORQUE)
    assert np.median(np.abs(np.abs(rate[behind]) - wanted)) < 0.1
    assert resisting.max() < TORQUE


def test_a_strong_servo_is_limited_in_rate_alone():
    """As its declaration says: that is the effect which it has as its limit."""
    values = {"torque": 1e6, "speed": 3.0}
    limit = get_effect("servo_torque_limit").in_parts(values)
    assert limit == {"servo_rate_limit": {"rate": 3.0}}
    strong = run({"servo_torque_limit": values}, BEAT, 2.0)
    assert_same_motion(strong, run(limit, BEAT, 2.0), atol=1e-6)


def test_smaller_steps_tell_the_same():
    coarse, fine = (run(WEAK, SWING, 2.0, dt=dt) for dt in (0.005, 0.001))
    plain = run(None, SWING, 2.0, dt=0.001)
    effect = np.abs(fine.states[:, :3] - plain.states[:, :3]).max()
    assert effect > 0.01
    assert np.abs(coarse.states[:, :3] - fine.states[:, :3]).max() < 0.02 * effect


def test_a_servo_that_the_water_overpowers_holds_its_tail():
    """The gear does not turn back: a tail that cannot move stays where it is."""
    none = {"servo_torque_limit": {"torque": 1e-4}}
    _, told = outputs(none, SWING, 1.0)
    assert np.abs(told["tail_angle"]).max() < 0.3
