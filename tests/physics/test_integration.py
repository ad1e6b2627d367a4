"""The integrator: order, time and switches."""

import numpy as np
import pytest

from fish_env.model.effect import Effect, EffectParameter
from fish_env.simulator import InitialState, Simulator
from tests.broken import broken_simulator
from tests.physics import checkers
from tests.physics.cases import SWIM, TUMBLE, WATER_EFFECTS, end_state, swimmer


def test_the_order_is_four_where_the_motion_is_smooth():
    """Errors fall sixteenfold when the step is halved; any slip in the scheme costs an order."""
    checkers.check_order(Simulator)


def test_the_order_is_four_with_effects_that_add_states_and_inertia():
    """An effect with a state of its own or in the mass matrix goes through the same four stages."""
    checkers.check_order(Simulator, WATER_EFFECTS)


def test_the_order_survives_a_switch_between_two_steps():
    """Steps end at a switch; stepping over it would leave an error of order one."""
    checkers.check_order_through_switch(Simulator)


def test_a_switch_acts_at_its_time_and_not_before():
    """Two schedules that differ from t = 0.5 on give the same bits until then."""
    simulator = Simulator(swimmer(), 0.01)
    times = [0.0, 0.25, 0.5, 0.5 + 1e-6, 0.75]
    plain = simulator.run(SWIM, sample_times_s=times, initial=TUMBLE)
    other = simulator.run(
        [*SWIM, {"t": 0.5, "tail_offset": -0.4}], sample_times_s=times, initial=TUMBLE
    )
    assert np.array_equal(plain.states[:3], other.states[:3])
    assert not np.array_equal(plain.states[3], other.states[3])


def test_time_is_index_times_step():
    """Summed steps would drift: after 1000 steps of 0.01 s by 1e-13 s, and every stage with it."""
    seen = []

    def note(water, place, time, e):
        seen.append(float(time))
        return water

    watch = Effect("watch", "surroundings", "", "", "", (EffectParameter("on", "-", 0.0),),
                   hooks={"water": note})  # fmt: skip
    broken_simulator({}, swimmer(), 0.01, user_effects=[watch]).run([{"t": 0.0}], duration_s=3.0)
    step = np.repeat(np.arange(10) * 0.01, 4).reshape(-1, 4) + 0.01 * np.array([0, 0.5, 0.5, 1])
    within = np.array(seen).reshape(30, 10, 4)
    starts = np.arange(30) / 10
    np.testing.assert_allclose(within, starts[:, None, None] + step, rtol=0, atol=4e-16 * 4)


@pytest.mark.parametrize("dt", [0.01, 0.0037])
def test_the_result_depends_on_the_step_only_by_its_error(dt):
    """Steps are shortened to meet the samples, whatever dt is."""
    fine = end_state(Simulator(swimmer(), 0.001), SWIM, 0.5, TUMBLE)
    np.testing.assert_allclose(
        end_state(Simulator(swimmer(), dt), SWIM, 0.5, TUMBLE), fine, atol=5e-6
    )


def test_the_quaternion_stays_a_unit():
    """Normalised after every step, also in a fast tumble."""
    start = InitialState(angular_velocity_body=(9.0, -7.0, 8.0))
    run = Simulator(swimmer(), 0.02).run(SWIM, duration_s=2.0, initial=start)
    np.testing.assert_allclose(np.linalg.norm(run.states[:, 3:7], axis=1), 1.0, atol=1e-15)
