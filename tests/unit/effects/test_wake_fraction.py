"""The tail meets slower water, the body does not."""

import numpy as np

from fish_env.simulator import Simulator
from tests.physics.cases import random_inputs, random_states, swimmer

EFFECTS = {"wake_fraction": {"fraction": 0.3}}


def test_the_tail_is_that_of_a_slower_fish_and_the_body_is_not():
    """Tail lift and drag at (1 - fraction) u; every other term at u."""
    rng = np.random.default_rng(4)
    wake, plain = Simulator(swimmer(), effects=EFFECTS), Simulator(swimmer())
    for state, inputs in zip(random_states(rng, 20), random_inputs(rng, 20), strict=True):
        slow = state.copy()
        slow[7] *= 0.7
        here = wake.wrench_by_term(state, inputs)
        body, tail = plain.wrench_by_term(state, inputs), plain.wrench_by_term(slow, inputs)
        for name in body:
            expected = tail[name] if name.startswith("tail_") else body[name]
            np.testing.assert_allclose(here[name], expected, atol=1e-14, err_msg=name)


def test_thrust_holds_up_better_with_speed():
    """Which is what tells it from a larger gain: none at rest, more the faster."""
    inputs = [0.0, 0.35, 2.0, 0.0, 0.0]
    wake, plain = Simulator(swimmer(), effects=EFFECTS), Simulator(swimmer())
    gains = []
    for speed in (0.0, 0.1, 0.2):
        thrust = []
        for simulator in (wake, plain):
            forces = []
            for phase in np.linspace(0.0, 2 * np.pi, 48, endpoint=False):
                state = np.array([0, 0, 0, 1, 0, 0, 0, speed, 0, 0, 0, 0, 0, phase])
                terms = simulator.wrench_by_term(state, inputs)
                forces.append(terms["tail_drag"][0] + terms["tail_lift"][0])
            thrust.append(np.mean(forces))
        gains.append(thrust[0] - thrust[1])
    assert gains[0] == 0.0
    assert 0.0 < gains[1] < gains[2]
