"""Buoyancy offset, current and the recorders' clocks."""

import numpy as np
import pytest

from fish_env.effects.extended import build_model
from fish_env.sensing import measured_channels, true_command_times, true_times
from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import rotation, swimmer

STILL = [{"t": 0.0}]


@pytest.mark.parametrize("mass", [0.01, -0.005])
def test_extra_buoyancy_lifts_a_resting_fish(mass):
    """dw/dt = -mass g / m_total at rest; the effect equals the parameter it shifts."""
    rest = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    shifted = Simulator(swimmer(), effects={"buoyancy_offset": {"mass": mass}})
    assert shifted.state_derivative(rest)[9] == pytest.approx(-mass * 9.81 / 2.0, rel=1e-12)
    heavier = Simulator(swimmer().replace({"mass.buoyancy": 2.0 + mass}))
    one, two = (x.run(STILL, duration_s=3.0).states for x in (shifted, heavier))
    np.testing.assert_allclose(one[:, :14], two[:, :14], atol=1e-12)


def test_a_current_reaches_every_hydrodynamic_term():
    """At rest over ground, the water terms are those of a fish that moves the other way."""
    flow = {"north": 0.2, "east": -0.1, "down": 0.15}
    rest = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    moving = [0, 0, 0, 1, 0, 0, 0, -0.2, 0.1, -0.15, 0, 0, 0]
    inputs = [0.2, 0.3, 2.0, 0.0, 0.0]
    in_current = Simulator(swimmer(), effects={"current": flow}).wrench_by_term(rest, inputs)
    in_still = Simulator(swimmer()).wrench_by_term(moving, inputs)
    for name in ("xz_drag", "xz_lift", "xy_drag", "xy_lift", "tail_drag", "tail_lift", "impact"):
        np.testing.assert_allclose(in_current[name], in_still[name], atol=1e-14, err_msg=name)
        assert np.any(in_current[name] != 0)


def test_the_velocity_through_the_water_is_reported():
    run = Simulator(swimmer(), effects={"current": {"north": 0.1}}).run(STILL, duration_s=1.0)
    through = Simulator(swimmer(), effects={"current": {"north": 0.1}}).outputs(run)
    flow = [0.1 * rotation(state)[0, 0] for state in run.states]
    np.testing.assert_allclose(through["surge_through_water"], run["u"] - flow, atol=1e-15)


def test_a_clock_scale_stretches_the_whole_log_and_nothing_else():
    """Recorded t is scale t of samples and commands; channels pass unchanged, the motion too."""
    model = build_model(swimmer(), {"clock_scale": {"scale": 1.02}})
    np.testing.assert_allclose(true_times(model, [0.0, 1.0, 10.0]), [0.0, 1.02, 10.2])
    np.testing.assert_allclose(true_command_times(model, [0.0, 10.0]), [0.0, 10.2])
    channels = {"x": np.arange(3.0)}
    assert measured_channels(model, channels)["x"] is channels["x"]
    plain = Simulator(swimmer()).run(STILL, duration_s=1.0).states
    scaled = Simulator(swimmer(), effects={"clock_scale": {"scale": 1.02}})
    assert scaled.run(STILL, duration_s=1.0).states.tobytes() == plain.tobytes()
    assert scaled.model.declared == ()


def test_a_clock_skew_leaves_the_commands_where_they_are():
    """Two recorders: what one stamps is true, what the other stamps is stretched."""
    both = {"clock_skew": {"scale": 1.1}, "clock_scale": {"scale": 0.5}}
    model = build_model(swimmer(), both)
    np.testing.assert_allclose(true_times(model, [0.0, 10.0]), [0.0, 5.5])
    np.testing.assert_allclose(true_command_times(model, [0.0, 10.0]), [0.0, 5.0])
    skewed = build_model(swimmer(), {"clock_skew": {"scale": 1.1}})
    np.testing.assert_array_equal(true_command_times(skewed, [0.0, 10.0]), [0.0, 10.0])


def test_a_swimming_fish_drifts_off_its_path_by_the_current_alone():
    """Start at rest in the water: path = path in still water + current x time."""
    commands = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0, "tail_offset": 0.2}]
    flow = np.array([0.05, -0.03, 0.0])
    still = Simulator(swimmer(), 0.002).run(commands, duration_s=4.0)
    effects = {"current": {"north": 0.05, "east": -0.03}}
    carried = Simulator(swimmer(), 0.002, effects).run(
        commands, duration_s=4.0, initial=InitialState(velocity_body=tuple(flow))
    )
    expected = still.states[:, :3] + still.time_s[:, None] * flow
    np.testing.assert_allclose(carried.states[:, :3], expected, atol=1e-7)
