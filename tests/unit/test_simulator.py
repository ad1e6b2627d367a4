"""The way in: schedules, initial states, sample times, errors, outputs."""

import numpy as np
import pytest

from fish_env.errors import ParameterError, ScheduleError
from fish_env.model.frames import euler_from_quaternion, quaternion_from_euler
from fish_env.model.state import BASE_STATES
from fish_env.simulator import InitialState, Simulator, schedule, time_grid
from tests.physics.cases import SWIM, TUMBLE, lopsided, random_inputs, random_states, swimmer
from tests.reference_model import mass_properties


def test_a_schedule_keeps_what_a_row_leaves_out():
    steps = schedule(
        [
            {"t": 0, "tail_amplitude": 0.3, "tail_frequency": 2},
            {"t": 1.5, "tail_offset": 0.2},
            {"t": 2, "tail_amplitude": 0.0},
        ]
    )
    assert steps.times_s.tolist() == [0.0, 1.5, 2.0]
    assert steps.at([0.0, 1.49, 1.5, 9.0]).tolist() == [
        [0.0, 0.3, 2.0, 0.0, 0.0],
        [0.0, 0.3, 2.0, 0.0, 0.0],
        [0.2, 0.3, 2.0, 0.0, 0.0],
        [0.2, 0.0, 2.0, 0.0, 0.0],
    ]


@pytest.mark.parametrize(
    ("rows", "problem"),
    [
        ([], "empty"),
        ([{"tail_amplitude": 0.3}], "a row without 't'"),
        ([{"t": 0, "tail_amplitud": 0.3}], r"unknown command \['tail_amplitud'\]"),
        ([{"t": 0}, {"t": 0}], "increase"),
        ([{"t": 1}, {"t": 0}], "increase"),
        ([{"t": float("nan")}], "finite"),
        ([{"t": 0, "tail_offset": float("nan")}], "finite"),
        ([{"t": 0, "tail_offset": float("inf")}], "finite"),
    ],
)
def test_a_wrong_schedule_is_refused(rows, problem):
    with pytest.raises(ScheduleError, match=problem):
        schedule(rows)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({}, "either duration_s"),
        ({"duration_s": 1.0, "sample_times_s": [0.0, 1.0]}, "either duration_s"),
        ({"duration_s": 0.0}, "must be positive"),
        ({"duration_s": float("nan")}, "must be positive"),
        ({"duration_s": 1.0, "rate_hz": 0.0}, "must be positive"),
        ({"sample_times_s": [0.0]}, "at least two"),
        ({"sample_times_s": [0.0, 0.0]}, "increasing"),
        ({"sample_times_s": [0.0, float("inf")]}, "increasing"),
        ({"duration_s": 1.0, "initial": InitialState(position=(np.nan, 0, 0))}, "finite"),
    ],
)
def test_a_wrong_run_is_refused(options, problem):
    with pytest.raises(ScheduleError, match=problem):
        Simulator("zheng-2021-a").run(SWIM, **options)


@pytest.mark.parametrize("dt", [0.0, -0.01, 0.2, float("nan")])
def test_a_step_out_of_range_is_refused(dt):
    with pytest.raises(ScheduleError, match="choose a physics step"):
        Simulator("zheng-2021-a", dt)


def test_an_unknown_fish_is_refused():
    with pytest.raises(ParameterError, match="zheng-2021-a"):
        Simulator("zheng-2021-aa")


def test_samples_lie_where_they_are_asked_for():
    """A rate up to the duration, a last sample at the duration, or given times."""
    simulator = Simulator("zheng-2021-a")
    assert simulator.run(SWIM, duration_s=1.0).time_s.tolist() == [i / 10 for i in range(11)]
    odd = simulator.run(SWIM, duration_s=0.25, rate_hz=10).time_s
    np.testing.assert_allclose(odd, [0.0, 0.1, 0.2, 0.25])
    times = [0.5, 0.61, 0.9]
    np.testing.assert_array_equal(simulator.run(SWIM, sample_times_s=times).time_s, times)


def test_the_grid_meets_samples_and_switches_with_steps_no_longer_than_dt():
    grid, starts = time_grid(np.array([0.0, 0.1, 0.25]), np.array([-1.0, 0.07, 0.1, 9.0]), 0.04)
    np.testing.assert_allclose(starts, [0.0, 0.07, 0.1])
    np.testing.assert_allclose(grid.starts, starts)
    np.testing.assert_array_equal(grid.steps, [2, 1, 4])
    np.testing.assert_allclose(grid.sizes * grid.steps, [0.07, 0.03, 0.15])
    assert np.all(grid.sizes <= 0.04)
    np.testing.assert_array_equal(grid.every[1:], grid.steps[1:])
    assert grid.every[0] > grid.steps[0]


def test_where_samples_lie_changes_the_motion_only_by_the_integrators_error():
    simulator = Simulator("zheng-2021-a", 0.002)
    coarse = simulator.run(SWIM, duration_s=1.0, rate_hz=2, initial=TUMBLE)
    fine = simulator.run(SWIM, duration_s=1.0, rate_hz=300, initial=TUMBLE)
    np.testing.assert_allclose(coarse.states[-1, :14], fine.states[-1, :14], atol=1e-7)


def test_the_initial_state_is_the_first_sample():
    run = Simulator("zheng-2021-a").run(SWIM, duration_s=0.1, initial=TUMBLE)
    np.testing.assert_array_equal(run.states[0], TUMBLE.vector())
    np.testing.assert_allclose(euler_from_quaternion(run.states[0, 3:7]), TUMBLE.euler)
    assert run.state_names == BASE_STATES
    assert InitialState().vector()[3] == 1.0


def test_the_tail_phase_is_two_pi_times_the_beats():
    """Continuous where the frequency switches."""
    run = Simulator("zheng-2021-a").run(
        [{"t": 0, "tail_frequency": 1.5}, {"t": 1.0, "tail_frequency": 3.0}], duration_s=2.0
    )
    expected = 2 * np.pi * np.where(run.time_s < 1, 1.5 * run.time_s, 3 * run.time_s - 1.5)
    np.testing.assert_allclose(run["tail_phase"], expected, atol=1e-12)


def test_running_integrals_are_those_of_the_motion():
    """Heading vector against the trapezium rule over fine samples; the tail's energy only grows."""
    run = Simulator("zheng-2021-a", 0.002).run(SWIM, duration_s=1.0, rate_hz=500, initial=TUMBLE)
    for name, values in (("cosine", np.cos(run["yaw"])), ("sine", np.sin(run["yaw"]))):
        integral = np.trapezoid(values, run.time_s)
        assert run[f"heading_{name}_integral"][-1] == pytest.approx(integral, abs=1e-4)
    assert run["surge_integral"][-1] == pytest.approx(np.trapezoid(run["u"], run.time_s), abs=1e-5)
    assert np.all(np.diff(run["tail_energy"]) >= 0)
    assert run["tail_energy"][-1] > 0


def test_outputs_are_those_of_the_equations():
    """Tail angle, its rate and the barycentre, sample by sample; power is never negative."""
    simulator = Simulator(lopsided())
    run = simulator.run(SWIM, duration_s=1.0, initial=TUMBLE)
    outputs = simulator.outputs(run)
    row = SWIM[0]
    amplitude, phase = row["tail_amplitude"], run["tail_phase"]
    np.testing.assert_allclose(
        outputs["tail_angle"], row["tail_offset"] + amplitude * np.sin(phase), atol=1e-14
    )
    rate = 2 * np.pi * row["tail_frequency"] * amplitude * np.cos(phase)
    np.testing.assert_allclose(outputs["tail_rate"], rate, atol=1e-13)
    _, centre, _ = mass_properties(
        lopsided().values(), row["block_displacement"], row["block_angle"]
    )
    for axis, name in enumerate("xyz"):
        np.testing.assert_allclose(outputs[f"barycentre_{name}"], centre[axis], atol=1e-16)
    np.testing.assert_allclose(outputs["surge_through_water"], run["u"])
    assert np.all(outputs["tail_power"] >= 0)


def test_the_servos_power_is_what_the_tail_gives_the_water():
    """-(arm x F)_z d(xi)/dt where positive, with the force of the terms."""
    simulator = Simulator(swimmer())
    rng = np.random.default_rng(8)
    positive = 0
    for state, inputs in zip(random_states(rng, 30), random_inputs(rng, 30), strict=True):
        terms = simulator.wrench_by_term(state, inputs)
        force = terms["tail_drag"][:3] + terms["tail_lift"][:3]
        angle = inputs[0] + inputs[1] * np.sin(state[13])
        rate = 2 * np.pi * inputs[2] * inputs[1] * np.cos(state[13])
        arm = -swimmer().get("tail.center_of_pressure") * np.array([np.cos(angle), np.sin(angle)])
        power = -(arm[0] * force[1] - arm[1] * force[0]) * rate
        slope = simulator.state_derivative(state, inputs)[17]
        assert slope == pytest.approx(max(power, 0.0), abs=1e-12)
        positive += power > 0
    assert 0 < positive < 30


def test_rates_of_offset_and_amplitude_enter_the_tails_motion():
    """Slewing actuators add offset' + amplitude' sin(phase) to the tail's rate."""
    state = np.zeros(14)
    state[3], state[13] = 1.0, 0.6
    inputs, rates = [0.1, 0.3, 2.0, 0.0, 0.0], [0.5, -0.4, 0.0, 0.0, 0.0]
    simulator = Simulator(swimmer())
    slewing = simulator.wrench_by_term(state, inputs, 0.0, rates)["tail_drag"]
    rate = 2 * np.pi * 2.0 * 0.3 * np.cos(0.6) + 0.5 - 0.4 * np.sin(0.6)
    faster = rate / (2 * np.pi * 0.3 * np.cos(0.6))
    same = simulator.wrench_by_term(state, [0.1, 0.3, faster, 0.0, 0.0])["tail_drag"]
    np.testing.assert_allclose(slewing, same, rtol=1e-12)


def test_a_state_of_the_wrong_size_is_refused():
    simulator = Simulator("zheng-2021-a")
    for wrong in (np.zeros(12), np.zeros(40), np.zeros((2, 13))):
        with pytest.raises(ScheduleError, match="between 13 and"):
            simulator.state_derivative(wrong)


def test_euler_angles_and_quaternions_agree():
    """Z-Y-X both ways, the rotation matrix of the reference in between."""
    rng = np.random.default_rng(0)
    euler = rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (100, 3))
    np.testing.assert_allclose(
        euler_from_quaternion(quaternion_from_euler(euler)), euler, atol=1e-12
    )
