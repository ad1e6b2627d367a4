"""Effects made in Python, without a file of their own."""

import numpy as np
import pytest

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import fingerprint, kernel
from fish_env.model.records import Wrench
from fish_env.simulator import Simulator

AHEAD = np.array([0, 0, 0, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0])


def push(strength):
    """A constant push forward, its strength enclosed in the kernel."""

    @kernel
    def force(motion, tail, inputs, centre, fish, e):
        return Wrench(strength * e.on, 0.0, 0.0, 0.0, 0.0, 0.0)

    parameter = EffectParameter("on", "-", 0.0, 0.0, 1.0, (0.0, 1.0), "on or off")
    return Effect("push", "hydrodynamics", "", "", "", (parameter,), hooks={"wrench": force})


@pytest.mark.slow
@pytest.mark.long
def test_two_effects_of_one_name_do_not_share_machine_code():
    """The second would silently run the first one's kernel, in this process or a later one."""
    for strength in (1.0, 10.0):
        effects = {"push": {"on": 1.0}}
        simulator = Simulator("zheng-2021-a", effects=effects, user_effects=[push(strength)])
        assert simulator.wrench_by_term(AHEAD)["push"][0] == pytest.approx(strength)


def test_a_fingerprint_tells_code_constants_and_what_they_refer_to():
    one, same, other = (push(strength).hooks["wrench"] for strength in (1.0, 1.0, 2.0))
    assert fingerprint(one) == fingerprint(same)
    assert fingerprint(one) != fingerprint(other)
