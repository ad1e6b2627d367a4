"""A tail force that lags its motion."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import BEAT, run

LAG = 0.1
EFFECTS = {"wake_memory": {"time_constant": LAG}}


def forces(trajectory):
    """Quasi-steady force of the tail and the force that acts, both (T, 3)."""
    simulator = Simulator(swimmer(), 0.01, EFFECTS)
    steady, acting = [], []
    for state, inputs, time in zip(
        trajectory.states, trajectory.inputs, trajectory.time_s, strict=True
    ):
        terms = simulator.wrench_by_term(state, inputs, time)
        lift_and_drag = terms["tail_drag"][:3] + terms["tail_lift"][:3]
        steady.append(lift_and_drag)
        acting.append(lift_and_drag + terms["wake_memory"][:3])
    return np.array(steady), np.array(acting)


def test_the_force_obeys_its_equation_along_a_run():
    """T dF/dt + F = quasi-steady F, by differences; it acts at the tail's place."""
    swim = run(EFFECTS, seconds=1.0, dt=0.001, rate_hz=1000)
    steady, acting = forces(swim)
    slope = (acting[2:] - acting[:-2]) / 0.002
    np.testing.assert_allclose(LAG * slope + acting[1:-1], steady[1:-1], atol=2e-4)
    assert np.abs(steady).max() > 0.3


def test_a_run_starts_without_a_wake():
    """No force at first; the quasi-steady one once it is constant for long."""
    swim = run(EFFECTS, seconds=0.1)
    steady, acting = forces(swim)
    np.testing.assert_allclose(acting[0], 0.0, atol=1e-15)
    assert np.linalg.norm(steady[0]) > 0.1
    glide = run(EFFECTS, [{"t": 0.0, "tail_offset": 0.3}], 8.0, velocity_body=(0.3, 0.0, 0.0))
    steady, acting = forces(glide)
    np.testing.assert_allclose(acting[-1], steady[-1], atol=2e-3 + 0.2 * np.abs(steady[-1]).max())


def test_its_mean_over_a_beat_is_that_of_the_quasi_steady_force():
    """A lag shifts and flattens; but for what it still holds back, it takes nothing off."""
    swim = run(EFFECTS, BEAT, 6.0, dt=0.005, rate_hz=200)
    steady, acting = forces(swim)
    steady, acting = steady[-201:], acting[-201:]
    held_back = LAG * (acting[-1] - acting[0])
    lost = np.trapezoid(steady - acting, dx=0.005, axis=0)
    np.testing.assert_allclose(lost, held_back, atol=2e-3)
    assert np.ptp(acting[:, 1]) < 0.8 * np.ptp(steady[:, 1])


def test_the_moment_is_the_force_at_the_centre_of_pressure():
    """What the lag adds acts where lift and drag act."""
    simulator = Simulator(swimmer(), 0.01, EFFECTS)
    swim = run(EFFECTS, seconds=0.5)
    terms = simulator.wrench_by_term(swim.states[-1], swim.inputs[-1])
    angle = simulator.outputs(swim)["tail_angle"][-1]
    place = np.array([-0.1 - 0.055 * np.cos(angle), -0.055 * np.sin(angle), 0.0])
    force, moment = terms["wake_memory"][:3], terms["wake_memory"][3:]
    assert moment == pytest.approx(np.cross(place, force), abs=1e-12)
