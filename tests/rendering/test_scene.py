"""What lies between two scenes, and scenes of a trajectory."""

import numpy as np
import pytest

from fish_env import InitialState, Simulator
from fish_env.model.frames import quaternion_from_euler
from fish_env.rendering import Tank, between, scenes_of
from tests.rendering.scenes import FISH, scene

SWIM = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]


def moved(**changes):
    return scene(time_s=5.1, **changes)


def test_the_ends_are_the_scenes_themselves():
    first, second = scene(), moved(position=np.array([0.5, 0.0, 0.6]))
    assert between(first, second, 1.0) is second
    start = between(first, second, 0.0)
    np.testing.assert_allclose(start.position, first.position)
    np.testing.assert_allclose(start.quaternion, first.quaternion)
    assert start.time_s == first.time_s


def test_attitude_goes_the_short_way():
    """Across north, and whichever sign the quaternions have."""
    first, second = (0.0, 0.0, -0.1 % (2 * np.pi)), (0.0, 0.0, 0.1)
    a = scene(first)
    b = moved(quaternion=-quaternion_from_euler(second))
    middle = between(a, b, 0.5)
    north = quaternion_from_euler((0.0, 0.0, 0.0))
    assert abs(middle.quaternion @ north) == pytest.approx(1.0)
    assert np.sin(middle.euler[2]) == pytest.approx(0.0, abs=1e-12)


def test_the_tail_beats_between_scenes():
    """At 2 Hz and 10 scenes a second, straight lines between angles would miss the peaks."""
    actuators = np.array([0.1, 0.4, 2.0, 0.0, 0.0])
    phases = np.array([1.0, 1.0 + 0.4 * np.pi])
    angles = 0.1 + 0.4 * np.sin(phases)
    a = scene(actuators=actuators, tail_phase=phases[0], tail_angle=angles[0])
    b = moved(actuators=actuators, tail_phase=phases[1], tail_angle=angles[1])
    middle = between(a, b, 0.5).tail_angle
    assert middle == pytest.approx(0.1 + 0.4 * np.sin(phases.mean()))
    assert abs(middle - angles.mean()) > 0.05


def test_a_tail_that_lags_keeps_its_distance_from_the_beat():
    a, b = scene(tail_angle=0.3), moved(tail_angle=0.2)
    assert between(a, b, 0.25).tail_angle == pytest.approx(0.275)


def test_nothing_lies_between_the_end_of_an_episode_and_the_next():
    end, start = scene(), scene(time_s=0.0)
    assert between(end, start, 0.5) is start


def test_scenes_of_a_trajectory_follow_it():
    simulator = Simulator("zheng-2021-a")
    initial = InitialState(position=(0.0, 0.0, 0.5))
    run = simulator.run(SWIM, duration_s=2.0, rate_hz=30.0, initial=initial)
    setting, scenes = scenes_of(run, FISH, label="swim")
    assert len(scenes) == len(run)
    assert setting.tank == Tank()
    np.testing.assert_array_equal(scenes[20].position, run.states[20, :3])
    np.testing.assert_array_equal(scenes[20].wake, run.states[:20, :3])
    tail = simulator.outputs(run)["tail_angle"]
    np.testing.assert_allclose([s.tail_angle for s in scenes], tail, atol=1e-12)


def test_the_tail_of_a_trajectory_can_be_given():
    run = Simulator("zheng-2021-a").run(SWIM, duration_s=0.5)
    _, scenes = scenes_of(run, FISH, tail_angle=np.full(len(run), 0.123))
    assert {s.tail_angle for s in scenes} == {0.123}


def test_the_tank_holds_a_trajectory_that_leaves_the_usual_one():
    run = Simulator("zheng-2021-a").run(SWIM, duration_s=1.0)
    setting, scenes = scenes_of(run, FISH)
    depths = [s.position[2] for s in scenes]
    assert setting.tank.top < min(depths)
    assert setting.tank.bottom > max(depths)
