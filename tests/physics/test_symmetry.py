"""Mirrored fish, moving frames and rest."""

import numpy as np
import pytest

from fish_env.simulator import InitialState, Simulator
from tests.physics import checkers
from tests.physics.cases import ALL_EFFECTS, SWIM, TUMBLE, WATER_EFFECTS, swimmer

NO_CURRENT_ACROSS = {
    **ALL_EFFECTS,
    "current": {"down": 0.05},
    "wave": {**ALL_EFFECTS["wave"], "heading": 0.0},
}


@pytest.mark.parametrize("effects", [None, NO_CURRENT_ACROSS], ids=["baseline", "effects"])
def test_a_mirrored_fish_swims_a_mirrored_path(effects):
    """y, roll, yaw, v, p and r change sign when offset, beat and block angle are mirrored."""
    checkers.check_mirror(Simulator, effects)


@pytest.mark.parametrize("effects", [None, WATER_EFFECTS], ids=["baseline", "effects"])
def test_a_uniform_current_is_a_moving_frame(effects):
    """Only velocity relative to the water matters: also for added mass and the reactive tail."""
    checkers.check_galilean(Simulator, effects)


def test_a_trimmed_fish_at_rest_stays_at_rest():
    """Level, C_m below O_b, weight equal to buoyancy, tail still: nothing moves, to rounding."""
    run = Simulator(swimmer(), 0.01).run([{"t": 0.0}], duration_s=20.0)
    moving = run.states[:, :14] - run.states[0, :14]
    np.testing.assert_allclose(moving, 0.0, atol=1e-12)


def test_a_fish_at_rest_drifts_with_the_current():
    """Rest in the moving frame: the velocity over ground stays that of the water."""
    current = {"north": 0.2, "east": -0.1, "down": 0.05}
    start = InitialState(velocity_body=tuple(current.values()))
    run = Simulator(swimmer(), 0.01, {"current": current}).run(
        [{"t": 0.0}], duration_s=5.0, initial=start
    )
    expected = run.time_s[:, None] * np.array(list(current.values()))
    np.testing.assert_allclose(run.states[:, :3], expected, atol=1e-9)


def test_yaw_does_not_matter():
    """Water and gravity have no compass: a turned start gives the turned path."""
    turned = InitialState(
        (0.0, 0.0, 1.0),
        (TUMBLE.euler[0], TUMBLE.euler[1], TUMBLE.euler[2] + np.pi / 2),
        TUMBLE.velocity_body,
        TUMBLE.angular_velocity_body,
        TUMBLE.tail_phase,
    )
    start = InitialState((0.0, 0.0, 1.0), *list(vars(TUMBLE).values())[1:])
    simulator = Simulator(swimmer(), 0.01)
    one = simulator.run(SWIM, duration_s=1.0, initial=start)
    two = simulator.run(SWIM, duration_s=1.0, initial=turned)
    np.testing.assert_allclose(two["x"], -one["y"], atol=1e-11)
    np.testing.assert_allclose(two["y"], one["x"], atol=1e-11)
    np.testing.assert_allclose(two.states[:, 7:13], one.states[:, 7:13], atol=1e-11)
