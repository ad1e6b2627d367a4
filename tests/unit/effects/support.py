"""Fish and helpers that the tests of single effects share."""

from __future__ import annotations

import numpy as np

from fish_env.params.schema import FishParams
from fish_env.simulator import InitialState, Simulator
from fish_env.trajectory import Trajectory
from tests.physics.cases import dry, swimmer

MASS = 2.0
STILL = [{"t": 0.0}]
BEAT = [{"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.3, "tail_frequency": 2.0}]
REST = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], float)


def balanced() -> FishParams:
    """Fish A with its centre of mass at O_b, so that forces at O_b do not turn it."""
    return swimmer().replace({"mass.static_moment_rest[2]": -0.009})


def in_space(gravity: float = 0.0) -> FishParams:
    """The balanced fish without any force of the water."""
    return dry(balanced(), gravity)


def held() -> FishParams:
    """A fish too heavy for its tail to move it."""
    values = {"mass.total": 8e3, "mass.buoyancy": 8e3}
    values |= {f"inertia.rest[{i}]": 1e3 for i in range(3)}
    return swimmer().replace(values)


def run(
    effects: dict | None,
    commands: list = BEAT,
    seconds: float = 1.0,
    *,
    fish: FishParams | None = None,
    dt: float = 0.01,
    rate_hz: float = 50.0,
    **start,
) -> Trajectory:
    """A run of a fish with some effects; ``start`` are fields of the initial state."""
    simulator = Simulator(fish or swimmer(), dt, effects)
    return simulator.run(commands, seconds, InitialState(**start), rate_hz)


def tail(effects: dict | None, trajectory: Trajectory, dt: float = 0.01) -> tuple:
    """Angle (rad) and rate (rad/s) of the tail along a run of fish A."""
    outputs = Simulator(swimmer(), dt, effects).outputs(trajectory)
    return outputs["tail_angle"], outputs["tail_rate"]


def assert_same_motion(one: Trajectory, two: Trajectory, atol: float = 1e-12) -> None:
    """Pose and velocities agree along two runs."""
    np.testing.assert_allclose(one.states[:, :13], two.states[:, :13], rtol=0, atol=atol)
