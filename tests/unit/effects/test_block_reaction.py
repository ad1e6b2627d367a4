"""The hull recoils from the weight block: momentum of the two together."""

import numpy as np
import pytest

from fish_env.model.grid import Grid
from fish_env.simulator import Simulator
from tests.physics.cases import mass_matrix, rotation
from tests.unit.effects.support import MASS, in_space, run

EFFECTS = {"block_reaction": {"scale": 1.0}}
BLOCK = 0.3
LAG = {"block_lag": {"time_constant": 0.15}}
MOVE = [{"t": 0.0}, {"t": 0.2, "block_displacement": 0.014}]


@pytest.mark.parametrize("move", [{"block_displacement": 0.001}, {"block_angle": 0.02}])
def test_an_ideal_jump_displaces_the_hull_by_the_blocks_share(move):
    """No outer force: the centre of mass stays, so the hull moves by -m_w / m of it, and rests."""
    commands = [{"t": 0.0}, {"t": 0.2, **move}]
    moved = run(EFFECTS, commands, 2.0, fish=in_space(), dt=0.005)
    outputs = Simulator(in_space(), 0.005, EFFECTS).outputs(moved)
    before, after = np.array([outputs[f"barycentre_{axis}"][[0, -1]] for axis in "xyz"]).T
    shift = moved.states[-1, :3] + rotation(moved.states[-1]) @ after - before
    np.testing.assert_allclose(shift, 0.0, atol=0.05 * np.linalg.norm(after - before))
    np.testing.assert_allclose(moved.states[-1, 7:13], 0.0, atol=1e-4)


def test_without_it_the_hull_does_not_move():
    """The quasi-static block: nothing pushes."""
    moved = run(None, MOVE, 2.0, fish=in_space())
    np.testing.assert_allclose(moved.states[-1, :3], 0.0, atol=1e-15)


def linear_momentum(states, inputs, block_rate):
    """m (V + omega x C_m) + m_w d(C_w)/dt of each sample, inertial."""
    momenta = []
    for state, commands, rate in zip(states, inputs, block_rate, strict=True):
        generalised = mass_matrix(in_space(), commands) @ state[7:13]
        block = np.array([-BLOCK * rate, 0.0, 0.0])
        momenta.append(rotation(state) @ (generalised[:3] + block))
    return np.array(momenta)


def test_linear_momentum_stays_while_a_spinning_fish_moves_its_block():
    """Hull and block together, with the Coriolis force between them."""
    effects = {**EFFECTS, **LAG}
    spin = {"velocity_body": (0.2, -0.1, 0.05), "angular_velocity_body": (0.3, 0.8, -1.1)}
    moved = run(effects, MOVE, 2.0, fish=in_space(), dt=0.0025, rate_hz=20, **spin)
    position = moved["block_lag.position"]
    inputs = moved.inputs.copy()
    inputs[:, 3] = position
    rate = (moved.inputs[:, 3] - position) / 0.15
    late = (moved.time_s < 0.19) | (moved.time_s > 0.4)  # the start of the move is spread out
    momenta = linear_momentum(moved.states, inputs, rate)[late]
    np.testing.assert_allclose(momenta, np.tile(momenta[0], (len(momenta), 1)), atol=2e-4)
    neglected = run(LAG, MOVE, 2.0, fish=in_space(), dt=0.0025, rate_hz=20, **spin)
    drift = linear_momentum(neglected.states, inputs, rate)
    assert np.abs(drift[late] - drift[0]).max() > 5e-3


def test_the_scale_scales_it():
    half = run({"block_reaction": {"scale": 0.5}}, MOVE, 1.0, fish=in_space(), dt=0.005)
    full = run(EFFECTS, MOVE, 1.0, fish=in_space(), dt=0.005)
    assert half["x"][-1] == pytest.approx(0.5 * full["x"][-1], rel=0.01)
    assert full["x"][-1] == pytest.approx(BLOCK / MASS * 0.014, rel=0.05)


def test_a_slewing_block_is_followed_without_delay():
    """At constant rate the hull moves at constant speed, -m_w / m times that of the block."""
    simulator = Simulator(in_space(), 0.01, EFFECTS)
    kernels, record = simulator.model.kernels, simulator.model.record
    state, inputs = np.zeros((len(kernels.state_names), 1)), np.zeros((5, 1))
    state[3] = 1.0
    kernels.initialise(state, inputs, record, np.zeros(1))
    one = np.ones(1, np.int64)
    target = np.zeros((1, 5, 1))
    target[0, 3] = 0.02
    slew = np.full((5, 1), np.inf)
    slew[3] = 0.02
    kernels.advance(
        state,
        inputs,
        record,
        slew,
        np.zeros(1),
        target,
        Grid(0 * one, np.zeros(1), 50 * one, np.full(1, 0.01), one),
        tables=simulator.model.tables,
        failed_at=np.full(1, np.inf),
    )
    followed = dict(zip(kernels.state_names, state[:, 0], strict=True))
    assert inputs[3, 0] == pytest.approx(0.01)
    assert followed["block_reaction.stroke"] == pytest.approx(0.01, abs=1e-9)
    assert followed["block_reaction.stroke_rate"] == pytest.approx(0.02, abs=1e-9)
    hull = mass_matrix(in_space(), inputs[:, 0]) @ state[7:13, 0]
    assert hull[0] == pytest.approx(BLOCK * 0.02, rel=1e-6)
