"""Against the independent implementation, and against trajectories kept from it."""

import json
from pathlib import Path

import numpy as np
import pytest

from fish_env.simulator import InitialState, Simulator
from tests import reference_model
from tests.physics import checkers
from tests.physics.cases import SWIM, TUMBLE, lopsided

SPECIFIED = Path(__file__).resolve().parents[3] / "shared" / "spec" / "golden"


def test_accelerations_equal_the_reference():
    """Three different fish, states all over: to rounding."""
    checkers.check_reference_derivative(Simulator)


def test_trajectories_equal_the_reference():
    """Those in tests/golden, at a step that leaves an error below 1e-7."""
    checkers.check_golden(Simulator, dt=0.001, atol=1e-7)


def test_a_lopsided_tumble_equals_the_reference():
    """Everything off its plane of symmetry, at a step that leaves an error below 1e-8."""
    times = np.linspace(0.0, 1.0, 5)
    initial = {
        "position_inertial": TUMBLE.position,
        "euler_roll_pitch_yaw": TUMBLE.euler,
        "velocity_body": TUMBLE.velocity_body,
        "angular_velocity_body": TUMBLE.angular_velocity_body,
        "tail_phase": TUMBLE.tail_phase,
    }
    commands = [*SWIM, {"t": 0.5, "tail_offset": -0.3, "block_displacement": 0.01}]
    expected = reference_model.simulate(lopsided().values(), commands, 1.0, initial, times)
    run = Simulator(lopsided(), 0.001).run(commands, sample_times_s=times, initial=TUMBLE)
    states = run.states[:, :13] * np.where(run.states[:, 3:4] < 0, -1.0, 1.0) ** checkers.SIGNED
    np.testing.assert_allclose(states, expected, rtol=0, atol=1e-8)


@pytest.mark.filterwarnings("ignore:.*beyond the crank")
@pytest.mark.parametrize("file", sorted(SPECIFIED.glob("*.json")), ids=lambda file: file.stem)
def test_trajectories_equal_the_specified_ones(file):
    """Those that came with the equations, where they are at hand."""
    case = json.loads(file.read_text())
    table = np.loadtxt(file.with_suffix(".csv"), delimiter=",", skiprows=1)
    given = case["initial"] or {}
    start = InitialState(
        euler=given.get("euler_roll_pitch_yaw", (0, 0, 0)),
        velocity_body=given.get("velocity_body", (0, 0, 0)),
        angular_velocity_body=given.get("angular_velocity_body", (0, 0, 0)),
        tail_phase=given.get("tail_phase", 0.0),
    )
    run = Simulator(case["fish"], 0.001).run(
        case["schedule"], initial=start, sample_times_s=table[:, 0]
    )
    states = run.states[:, :13] * np.where(run.states[:, 3:4] < 0, -1.0, 1.0) ** checkers.SIGNED
    np.testing.assert_allclose(states, table[:, 1:], rtol=0, atol=1e-7)
