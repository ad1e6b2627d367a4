"""Fish, motions and states that the physics tests share."""

from __future__ import annotations

import numpy as np

from fish_env.model.state import BASE_STATES
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams
from fish_env.simulator import InitialState, Simulator
from fish_env.trajectory import Trajectory
from tests import reference_model

SWIM = [
    {
        "t": 0.0,
        "tail_offset": 0.1,
        "tail_amplitude": 0.35,
        "tail_frequency": 2.0,
        "block_displacement": -0.006,
        "block_angle": 0.3,
    }
]
HOLD = [{"t": 0.0, "block_displacement": 0.012, "block_angle": 0.7}]
TUMBLE = InitialState(
    position=(0.3, -0.2, 1.0),
    euler=(0.6, -0.5, 2.0),
    velocity_body=(0.35, 0.08, -0.06),
    angular_velocity_body=(1.1, -0.7, 0.9),
    tail_phase=0.4,
)
ALL_EFFECTS = {
    "servo_lag": {"time_constant": 0.06},
    "added_mass": {
        "surge": 0.3,
        "sway": 1.6,
        "heave": 1.2,
        "roll": 0.001,
        "pitch": 0.006,
        "yaw": 0.008,
    },
    "tail_reactive": {"scale": 0.8},
    "buoyancy_offset": {"mass": 0.004},
    "current": {"north": 0.05, "east": -0.08, "down": 0.02},
    "wave": {"amplitude": 0.03, "frequency": 0.8, "phase": 0.5, "heading": 0.7, "tank_depth": 2.0},
}
WATER_EFFECTS = {name: ALL_EFFECTS[name] for name in ("added_mass", "tail_reactive", "servo_lag")}


def swimmer() -> FishParams:
    """The paper's fish A."""
    return load_fish("zheng-2021-a")


def lopsided() -> FishParams:
    """Fish A with its balance off every plane of symmetry."""
    return swimmer().replace(
        {
            "mass.static_moment_rest[0]": -0.011,
            "mass.static_moment_rest[1]": 0.008,
            "weight_block.bracket_origin[1]": 0.006,
            "tail.root[1]": 0.004,
            "tail.root[2]": -0.007,
        }
    )


def dry(fish: FishParams, gravity: float = 0.0) -> FishParams:
    """A fish in empty space: no water forces, no damping; the mass of displaced water is kept."""
    damping = {f"body.rotational_damping[{axis}]": 0.0 for axis in range(3)}
    return fish.replace({"water.density": 0.0, "water.gravity": gravity, **damping})


def random_states(rng: np.random.Generator, count: int) -> np.ndarray:
    """Base states over what a fish may meet, shape (count, 18), attitudes unit."""
    states = np.zeros((count, len(BASE_STATES)))
    states[:, 0:3] = rng.uniform(-2, 2, (count, 3))
    attitude = rng.normal(size=(count, 4))
    states[:, 3:7] = attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    states[:, 7:10] = rng.normal(size=(count, 3)) * 0.3
    states[:, 10:13] = rng.normal(size=(count, 3)) * 1.5
    states[:, 13] = rng.uniform(-20, 20, count)
    return states


def random_inputs(rng: np.random.Generator, count: int) -> np.ndarray:
    """Actuator positions, shape (count, 5)."""
    low = np.array([-0.6, 0.0, 0.0, -0.015, -0.9])
    high = np.array([0.6, 0.7, 4.0, 0.02, 0.9])
    return rng.uniform(low, high, (count, 5))


def random_values(rng: np.random.Generator) -> dict[str, float]:
    """Changes to fish A, each number somewhat off and the symmetric zeros no longer zero."""
    fish = swimmer()
    changes = {path: value * rng.uniform(0.7, 1.4) for path, value in fish.values().items()}
    for path in ("mass.static_moment_rest[1]", "tail.root[1]", "tail.root[2]"):
        changes[path] = rng.uniform(-0.01, 0.01)
    changes["weight_block.bracket_origin[1]"] = rng.uniform(-0.01, 0.01)
    changes["inertia.rest[0]"] = fish.get("inertia.rest[0]") * rng.uniform(0.9, 1.4)
    for axis in (1, 2):
        changes[f"inertia.rest[{axis}]"] = 0.0085 * rng.uniform(0.95, 1.05)
    for axis in range(3):
        changes[f"inertia.weight_block[{axis}]"] = 7e-5 * rng.uniform(0.9, 1.1)
    for path in ("weight_block.crank.l1", "weight_block.crank.l2"):
        changes[path] = fish.get(path)
    return changes


def mass_matrix(fish: FishParams, inputs: np.ndarray) -> np.ndarray:
    """6x6 mass matrix about O_b at the block's position, from the reference model."""
    mass, centre, inertia = reference_model.mass_properties(fish.values(), inputs[3], inputs[4])
    lever = mass * reference_model.cross_matrix(centre)
    return np.block([[mass * np.eye(3), -lever], [lever, inertia]])


def rotation(state: np.ndarray) -> np.ndarray:
    """Rotation matrix body to inertial of a state's quaternion."""
    w, v = state[3], state[4:7]
    skew = reference_model.cross_matrix(v)
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def end_state(simulator: Simulator, commands: list, duration: float, start: InitialState):
    """Pose, velocities and tail phase, then effect states, after a run.

    Without the running integrals, and without what effects remember, which is not integrated.
    """
    states = run_between(simulator, commands, 0.0, duration, start).states[-1]
    remembered = len(simulator.model.kernels.composition.memory_names)
    return np.delete(states[: len(states) - remembered], np.arange(14, 18))


def run_between(
    simulator: Simulator, commands: list, begin: float, end: float, start: InitialState
) -> Trajectory:
    """A run with samples at both ends only, so that steps depend on dt alone."""
    return simulator.run(commands, initial=start, sample_times_s=[begin, end])
