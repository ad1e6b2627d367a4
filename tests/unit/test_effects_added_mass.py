"""Added mass: Kirchhoff's equations for a body in an ideal fluid at rest."""

from functools import partial

import numpy as np
import pytest

from fish_env.simulator import InitialState, Simulator
from tests.broken import broken_simulator
from tests.physics.cases import (
    HOLD,
    TUMBLE,
    dry,
    lopsided,
    mass_matrix,
    rotation,
    run_between,
    swimmer,
)

MASSES = {"surge": 0.3, "sway": 1.6, "heave": 1.2, "roll": 0.001, "pitch": 0.006, "yaw": 0.008}
ADDED = np.diag(list(MASSES.values()))
EFFECT = {"added_mass": MASSES}


def kept(states, matrix):
    """Energy (T,), impulse and its moment about the origin, inertial, (T, 3), of body and fluid."""
    generalised = states[:, 7:13] @ matrix
    energy = 0.5 * np.sum(states[:, 7:13] * generalised, axis=1)
    turns = [rotation(state) for state in states]
    pairs = zip(turns, generalised, strict=True)
    impulse = np.array([turn @ momentum[:3] for turn, momentum in pairs])
    pairs = zip(turns, generalised, strict=True)
    spin = np.array([turn @ momentum[3:] for turn, momentum in pairs])
    return energy, impulse, spin + np.cross(states[:, :3], impulse)


def drift(dt, build):
    simulator = build(dry(lopsided()), dt, EFFECT)
    run = run_between(simulator, HOLD, 0.0, 1.0, TUMBLE)
    matrix = mass_matrix(lopsided(), run.inputs[0]) + ADDED
    return np.array(
        [np.linalg.norm(x[-1] - x[0]) / np.linalg.norm(x[0]) for x in kept(run.states, matrix)]
    )


def check_conservation(build):
    coarse, fine = drift(0.02, build), drift(0.01, build)
    assert np.all(fine < 1e-6)
    assert np.all(fine < coarse / 12)


def test_energy_and_impulse_of_body_and_fluid_stay():
    """Without drag nothing leaves the system; wrong Coriolis or Munk terms would show here."""
    check_conservation(Simulator)


@pytest.mark.parametrize("component", ["fx", "fz", "mx", "mz"])
def test_the_conservation_check_notices_a_missing_term(component):
    """Any component of the Coriolis and Munk terms left out: energy or impulse drifts."""
    call = "added_mass_wrench(motion, tail, inputs, centre, fish, e_added_mass)"
    replacements = {call: f"{call}._replace({component}=0.0)"}
    check_conservation(partial(broken_simulator, {}))
    with pytest.raises(AssertionError):
        check_conservation(partial(broken_simulator, replacements))


def test_the_munk_moment_turns_the_body_broadside():
    """-V x (M_A V): in sideslip to starboard the nose is pushed to port, by (m_y - m_x) u v."""
    u, v, w = 0.4, 0.1, -0.2
    state = [0, 0, 0, 1, 0, 0, 0, u, v, w, 0, 0, 0]
    wrench = Simulator(swimmer(), effects=EFFECT).wrench_by_term(state)["added_mass"]
    np.testing.assert_allclose(wrench[:3], 0.0, atol=1e-15)
    expected = [-(1.2 - 1.6) * v * w, -(0.3 - 1.2) * u * w, -(1.6 - 0.3) * u * v]
    np.testing.assert_allclose(wrench[3:], expected, rtol=1e-12)
    assert wrench[5] < 0


@pytest.mark.parametrize(("axis", "name"), [(2, "heave")])
def test_a_released_fish_speeds_up_against_body_and_water(axis, name):
    """Buoyant by 20 g and level: dw/dt = -0.02 g / (m + added mass in heave)."""
    fish = swimmer().replace({"mass.buoyancy": 2.02})
    state = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]
    acceleration = Simulator(fish, effects=EFFECT).state_derivative(state)[7 + axis]
    assert acceleration == pytest.approx(-0.02 * 9.81 / (2.0 + MASSES[name]), rel=1e-12)


def test_a_steady_rotation_in_a_current_needs_no_force_from_the_current():
    """At rest in the water while turning: V_rel = 0 stays 0, whatever the current."""
    fish = dry(swimmer().replace({"mass.static_moment_rest[2]": -0.009}))
    current = {"north": 0.3, "east": -0.2, "down": 0.1}
    start = InitialState(velocity_body=(0.3, -0.2, 0.1), angular_velocity_body=(0.0, 0.0, 2.0))
    run = Simulator(fish, 0.005, {**EFFECT, "current": current}).run(
        [{"t": 0.0}], duration_s=1.0, initial=start
    )
    expected = run.time_s[:, None] * np.array(list(current.values()))
    np.testing.assert_allclose(run.states[:, :3], expected, atol=1e-9)
