"""Single terms of the model: what they do to the energy, and the balances they settle at."""

import numpy as np
import pytest

from fish_env.simulator import InitialState, Simulator
from tests.physics import checkers
from tests.physics.cases import (
    ALL_EFFECTS,
    lopsided,
    mass_matrix,
    random_inputs,
    random_states,
    swimmer,
)


def test_drag_takes_power_and_lift_does_no_work():
    """In random states, each term by itself against the flow at its own point."""
    checkers.check_drag_power(Simulator)


def test_a_fish_at_rest_settles_at_its_trim():
    """Block aft and aside, tail still: pitch and roll in closed form."""
    checkers.check_trim(Simulator)


@pytest.mark.parametrize("excess", [0.02, -0.03])
def test_a_level_fish_sinks_or_rises_at_its_terminal_velocity(excess):
    """Weight less buoyancy balances the drag at 90 degrees: |w| w = 2 dm g / (rho S_zz C_D)."""
    fish = swimmer().replace({"mass.buoyancy": 2.0 - excess, "tail.area": 1e-9})
    run = Simulator(fish, 0.01).run([{"t": 0.0}], duration_s=20.0)
    coefficient = fish.get("body.plane_xz.drag.c0") + fish.get("body.plane_xz.drag.c2")
    area = fish.get("body.area[2]")
    speed = np.sqrt(2 * abs(excess) * 9.81 / (1000.0 * area * coefficient))
    assert run["w"][-1] == pytest.approx(np.sign(excess) * speed, rel=1e-6)
    assert run["pitch"][-1] == pytest.approx(0.0, abs=1e-6)


def test_drag_alone_stops_a_surging_fish_along_the_closed_form():
    """m du/dt = -c u^2 has u = u0 / (1 + c u0 t / m); C_D(0) counts once for each plane."""
    fish = swimmer().replace({"tail.area": 1e-9})
    run = Simulator(fish, 0.01).run(
        [{"t": 0.0}], duration_s=5.0, initial=InitialState(velocity_body=(0.5, 0.0, 0.0))
    )
    zero = fish.get("body.plane_xz.drag.c0") + fish.get("body.plane_xy.drag.c0")
    factor = 0.5 * 1000.0 * fish.get("body.area[0]") * zero / fish.get("mass.total")
    # The centre of mass lies below O_b, so slowing down pitches the fish by a few degrees.
    np.testing.assert_allclose(run["u"], 0.5 / (1 + factor * 0.5 * run.time_s), rtol=0.02)


def test_lift_pushes_towards_the_side_the_flow_comes_to():
    """Nose up against the path (w > 0): the lift is up (-z); sideslip to starboard: to port."""
    terms = Simulator(swimmer()).wrench_by_term(
        [0, 0, 0, 1, 0, 0, 0, 0.5, 0.1, 0.1, 0, 0, 0], np.zeros(5)
    )
    assert terms["xz_lift"][2] < 0
    assert terms["xy_lift"][1] < 0
    assert terms["impact"][4] > 0
    assert terms["impact"][5] < 0


def test_impact_moments_follow_their_factor():
    """1/2 rho |V_i|^2 S_i k sin(alpha) cos(alpha), alpha signed."""
    fish = swimmer()
    u, v, w = 0.4, -0.1, 0.15
    terms = Simulator(fish).wrench_by_term([0, 0, 0, 1, 0, 0, 0, u, v, w, 0, 0, 0], np.zeros(5))
    square_xz, square_xy = u * u + w * w, u * u + v * v
    s_xz = (0.0122 * u * u + 0.0205 * w * w) / square_xz
    s_xy = (0.0122 * u * u + 0.0240 * v * v) / square_xy
    expected = [0.0, 500.0 * s_xz * 0.050 * u * w, 500.0 * s_xy * -0.080 * u * v]
    np.testing.assert_allclose(terms["impact"][3:], expected, rtol=1e-12)
    np.testing.assert_array_equal(terms["impact"][:3], 0.0)


def test_the_terms_sum_to_mass_times_acceleration():
    """M [dV/dt, domega/dt] = sum of all terms, with M from the reference model."""
    rng = np.random.default_rng(2)
    fish = lopsided()
    simulator = Simulator(fish)
    for state, inputs in zip(random_states(rng, 40), random_inputs(rng, 40), strict=True):
        total = sum(simulator.wrench_by_term(state, inputs).values())
        acceleration = simulator.state_derivative(state, inputs)[7:13]
        np.testing.assert_allclose(mass_matrix(fish, inputs) @ acceleration, total, atol=1e-11)


def test_the_terms_sum_with_added_mass_too():
    """Each effect with a wrench is a term of its own, its inertia part of the mass matrix."""
    rng = np.random.default_rng(3)
    fish = lopsided()
    effects = {key: ALL_EFFECTS[key] for key in ("added_mass", "current", "buoyancy_offset")}
    simulator = Simulator(fish, effects=effects)
    added = np.diag(list(ALL_EFFECTS["added_mass"].values()))
    for state, inputs in zip(random_states(rng, 40), random_inputs(rng, 40), strict=True):
        total = sum(simulator.wrench_by_term(state, inputs).values())
        acceleration = simulator.state_derivative(state, inputs)[7:13]
        matrix = mass_matrix(fish, inputs) + added
        np.testing.assert_allclose(matrix @ acceleration, total, atol=1e-11)


@pytest.mark.parametrize("velocity", [(0, 0, 0), (0.4, 0, 0), (0, 0.3, 0), (0, 0, -0.3)])
def test_no_force_is_singular_where_the_flow_stops_or_lies_along_an_axis(velocity):
    """The angle of attack is undefined at rest and its slope infinite at 90 degrees."""
    simulator = Simulator(swimmer())
    state = np.array([0, 0, 0, 1, 0, 0, 0, *velocity, 0, 0, 0], float)
    here = simulator.state_derivative(state)
    assert np.all(np.isfinite(here))
    for axis in range(7, 13):
        near = state.copy()
        near[axis] += 1e-9
        np.testing.assert_allclose(simulator.state_derivative(near), here, atol=1e-6)
