"""A stalled tail keeps its drag and loses a part of its lift."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import REST

STALL = {"tail_stall": {"loss": 0.6, "onset": 0.8, "width": 0.05}}


@pytest.mark.parametrize(("sway", "left"), [(0.05, 1.0), (3.0, 0.4)])
def test_lift_is_lost_beyond_the_onset_alone(sway, left):
    """Incidence of a still tail in a flow from the side: atan(sway / surge)."""
    state = REST.copy()
    state[7:9] = 0.3, sway
    inputs = [0.0, 0.0, 0.0, 0.0, 0.0]
    stalled = Simulator(swimmer(), effects=STALL).wrench_by_term(state, inputs)
    whole = Simulator(swimmer()).wrench_by_term(state, inputs)
    np.testing.assert_allclose(stalled["tail_lift"], left * whole["tail_lift"], rtol=1e-3)
    np.testing.assert_array_equal(stalled["tail_drag"], whole["tail_drag"])


def test_half_the_loss_is_at_the_onset():
    state = REST.copy()
    state[7:9] = np.cos(0.8), np.sin(0.8)
    stalled = Simulator(swimmer(), effects=STALL).wrench_by_term(state)
    whole = Simulator(swimmer()).wrench_by_term(state)
    np.testing.assert_allclose(stalled["tail_lift"], 0.7 * whole["tail_lift"], rtol=1e-9)
