"""A wave carries the water round, and its pressure pushes the hull."""

import numpy as np
import pytest

from fish_env.effects.wave import wave_number
from fish_env.model.jit import py_function
from fish_env.model.state import BASE_STATES
from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import dry, swimmer
from tests.unit.effects.support import REST, STILL, balanced

G = 9.81
HEAVY = {"surge": 0.3, "sway": 1.6, "heave": 1.2, "roll": 0.001, "pitch": 0.006, "yaw": 0.008}


def number(frequency, depth):
    """Wave number, by bisection of the dispersion relation."""
    low, high = 1e-6, 1e3
    for _ in range(200):
        middle = 0.5 * (low + high)
        short = G * middle * np.tanh(middle * depth) < (2 * np.pi * frequency) ** 2
        low, high = (middle, high) if short else (low, middle)
    return low


def flow(wave, place, time):
    """Velocity of the water (m/s, inertial) by Airy's formulas."""
    depth = min(wave.get("tank_depth", np.inf), 1e3)
    k = number(wave["frequency"], depth)
    along = np.array([np.cos(wave["heading"]), np.sin(wave["heading"])])
    theta = 2 * np.pi * wave["frequency"] * time - k * (along @ place[:2]) + wave["phase"]
    fall = np.exp(-k * place[2])
    mirror = np.exp(-2 * k * depth) / fall
    size = wave["amplitude"] / (1 - np.exp(-2 * k * depth))
    level, deep = size * (fall + mirror), size * (fall - mirror)
    return np.array([*(level * np.cos(theta) * along), deep * np.sin(theta)])


DEEP = {"amplitude": 0.05, "frequency": 0.8, "phase": 0.6, "heading": 0.7}
TANK = {**DEEP, "tank_depth": 0.9}


@pytest.mark.parametrize("frequency", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("depth", [0.3, 1.0, 20.0, np.inf])
def test_frequency_and_depth_give_the_wave_number(frequency, depth):
    """omega^2 = g k tanh(k H); in deep water k = omega^2 / g."""
    omega = 2 * np.pi * frequency
    k = py_function(wave_number)(omega, depth)
    assert G * k * np.tanh(k * depth) == pytest.approx(omega**2, rel=1e-9)


@pytest.mark.parametrize("wave", [DEEP, TANK], ids=["deep", "tank"])
def test_every_hydrodynamic_term_sees_the_orbital_flow(wave):
    """As if the fish moved the other way in still water, at its own place."""
    simulator = Simulator(swimmer(), effects={"wave": wave})
    for place in ((0.0, 0.0, 0.0), (0.4, -0.3, 0.5)):
        for time in (0.0, 0.37, 12.5):
            state = REST.copy()
            state[:3], state[7] = place, 0.3
            same = state.copy()
            same[7:10] -= flow(wave, np.array(place), time)
            here = simulator.wrench_by_term(state, time_s=time)
            still = Simulator(swimmer()).wrench_by_term(same)
            for name in ("xz_drag", "xy_lift", "tail_drag"):
                np.testing.assert_allclose(here[name], still[name], atol=1e-11)


@pytest.mark.parametrize("wave", [DEEP, TANK], ids=["deep", "tank"])
def test_the_pressure_pushes_with_the_displaced_mass(wave):
    """F = m_b DU/Dt, by differences along the water's own path."""
    simulator = Simulator(swimmer(), effects={"wave": wave})
    state = REST.copy()
    state[:3] = place = np.array([0.4, -0.3, 0.5])
    time, step = 1.3, 1e-5
    drift = step * flow(wave, place, time)
    later, earlier = flow(wave, place + drift, time + step), flow(wave, place - drift, time - step)
    force = simulator.wrench_by_term(state, time_s=time)["wave"]
    np.testing.assert_allclose(force[:3], 2.0 * (later - earlier) / (2 * step), rtol=1e-5)
    np.testing.assert_array_equal(force[3:], 0.0)


def strayed(effects, buoyancy=2.0):
    """How far a fish without drag that starts with the water leaves it (m/s)."""
    fish = dry(balanced()).replace({"mass.buoyancy": buoyancy})
    place = np.array([0.2, 0.1, 0.4])
    start = InitialState(tuple(place), velocity_body=tuple(flow(TANK, place, 0.0)))
    run = Simulator(fish, 0.005, {"wave": TANK, **effects}).run(STILL, 3.0, start)
    water = [flow(TANK, s[:3], t) for s, t in zip(run.states, run.time_s, strict=True)]
    return np.abs(run.states[:, 7:10] - water).max()


def test_a_neutral_body_goes_with_the_water_whatever_its_added_mass():
    """(m + M_A) dV/dt = (m_b + M_A) DU/Dt: with m = m_b the fish is a parcel of the water."""
    assert strayed({}) < 1e-6
    assert strayed({"added_mass": HEAVY}) < 1e-6
    assert strayed({"added_mass": HEAVY}, buoyancy=1.6) > 1e-3


def test_added_mass_alone_in_still_water_is_as_ever():
    """The acceleration of the water is all that a wave adds to it."""
    state = np.array([0, 0, 0.5, 1, 0, 0, 0, 0.3, 0.1, -0.05, 0.2, -0.3, 0.4])
    calm = {**TANK, "amplitude": 0.0}
    one = Simulator(swimmer(), effects={"added_mass": HEAVY}).state_derivative(state)
    two = Simulator(swimmer(), effects={"added_mass": HEAVY, "wave": calm}).state_derivative(state)
    fish = len(BASE_STATES)  # each kernel has states of its own effects behind these
    np.testing.assert_array_equal(one[:fish], two[:fish])


def test_a_wave_heaves_a_drifting_fish_at_its_frequency():
    """The response of a fish at rest holds the wave's frequency and little else."""
    wave = {"amplitude": 0.05, "frequency": 0.5}
    run = Simulator(swimmer(), 0.01, {"wave": wave}).run(STILL, duration_s=60.0, rate_hz=20)
    w = run["w"][run.time_s >= 20.0][:-1]
    spectrum = np.abs(np.fft.rfft(w - w.mean()))
    assert np.argmax(spectrum) / 40.0 == pytest.approx(0.5)
    assert np.abs(w).max() > 0.02  # carried by the water, not only dragged along
