"""The baseline model a second time: matrices, `solve` and an adaptive integrator.

Written from the equations alone and sharing no code with the package, so that a slip in one of
the two shows. Slow on purpose: every force is a 3-vector, the accelerations come out of one 6 x 6
system, and scipy's DOP853 steers its own step. `python -m tests.reference_model` writes the
trajectories in tests/golden afresh.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

GOLDEN = Path(__file__).parent / "golden"
COLUMNS = ("t", "x", "y", "z", "qw", "qx", "qy", "qz", "u", "v", "w", "p", "q", "r")
INPUT_NAMES = (
    "tail_offset",
    "tail_amplitude",
    "tail_frequency",
    "block_displacement",
    "block_angle",
)


def cross_matrix(a: np.ndarray) -> np.ndarray:
    """The matrix that turns `a x b` into a product with b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def triple(values: Mapping[str, float], path: str) -> np.ndarray:
    return np.array([values[f"{path}[{i}]"] for i in range(3)])


def mass_properties(
    values: Mapping[str, float], displacement: float, bracket_angle: float
) -> tuple[float, np.ndarray, np.ndarray]:
    """Total mass, centre of mass (3,) and inertia about O_b (3, 3) with the block at a place."""
    bracket = triple(values, "weight_block.bracket_origin")
    d1, d2, d3, rest = (values[f"weight_block.{key}"] for key in ("d1", "d2", "d3", "s_w0"))
    slider = rest + displacement
    block = bracket + np.array(
        [d1 - (slider - d3), d2 * np.sin(bracket_angle), d2 * np.cos(bracket_angle)]
    )
    total, m_block = values["mass.total"], values["mass.weight_block"]
    m_hull = total - m_block
    static = triple(values, "mass.static_moment_rest")
    hull = static / m_hull
    inertia = (
        np.diag(triple(values, "inertia.rest"))
        + np.diag(triple(values, "inertia.weight_block"))
        + m_hull * np.diag(hull @ hull - hull**2)
        + m_block * np.diag(block @ block - block**2)
    )
    return total, (static + m_block * block) / total, inertia


def plate_force(
    flow: np.ndarray,
    normal: np.ndarray,
    density: float,
    area: float,
    coefficients: tuple[float, float, float],
) -> np.ndarray:
    """Drag plus lift of a plate that moves with velocity `flow` through the water."""
    speed = np.linalg.norm(flow)
    if speed == 0.0:
        return np.zeros(3)
    direction = flow / speed
    sine = float(np.clip(normal @ direction, -1.0, 1.0))
    alpha = np.arcsin(abs(sine))
    c0, c2, c1 = coefficients
    pressure = 0.5 * density * speed**2 * area
    drag = -pressure * (c0 + c2 * np.sin(alpha) ** 2) * direction
    across = -np.sign(sine) * (np.eye(3) - np.outer(direction, direction)) @ normal
    length = np.linalg.norm(across)
    if length < 1e-14:
        return drag
    return drag + pressure * c1 * np.sin(alpha) * np.cos(alpha) * across / length


def coefficients(values: Mapping[str, float], path: str) -> tuple[float, float, float]:
    return values[f"{path}.drag.c0"], values[f"{path}.drag.c2"], values[f"{path}.lift.c1"]


def tail_wrench(
    values: Mapping[str, float],
    velocity: np.ndarray,
    spin: np.ndarray,
    phase: float,
    inputs: np.ndarray,
) -> np.ndarray:
    """Force and moment about O_b of the tail, (6,)."""
    offset, amplitude, frequency = inputs[:3]
    angle = offset + amplitude * np.sin(phase)
    rate = 2 * np.pi * frequency * amplitude * np.cos(phase)
    tail = Rotation.from_euler("z", angle).as_matrix()
    arm = tail @ [-values["tail.center_of_pressure"], 0.0, 0.0]
    place = triple(values, "tail.root") + arm
    flow = velocity + cross_matrix(spin) @ place + rate * cross_matrix(np.array([0, 0, 1.0])) @ arm
    force = plate_force(
        flow,
        tail @ [0.0, 1.0, 0.0],
        values["water.density"],
        values["tail.area"],
        coefficients(values, "tail"),
    )
    return np.concatenate([force, cross_matrix(place) @ force])


def body_wrench(values: Mapping[str, float], velocity: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Force and moment about O_b of the hull, (6,)."""
    areas, density = np.diag(triple(values, "body.area")), values["water.density"]
    wrench = np.zeros(6)
    planes = (("body.plane_xz", [1, 0, 1], 2, 4), ("body.plane_xy", [1, 1, 0], 1, 5))
    for path, mask, normal_axis, moment_row in planes:
        flow = np.diag(mask) @ velocity
        speed = np.linalg.norm(flow)
        if speed == 0.0:
            continue
        direction = flow / speed
        area = direction @ areas @ direction
        normal = np.eye(3)[normal_axis]
        wrench[:3] += plate_force(flow, normal, density, area, coefficients(values, path))
        alpha = np.arcsin(np.clip(normal @ direction, -1.0, 1.0))
        lever = values[f"{path}.impact_moment"] * np.sin(alpha) * np.cos(alpha)
        wrench[moment_row] += 0.5 * density * speed**2 * area * lever
    wrench[3:] += np.diag(triple(values, "body.rotational_damping")) @ spin
    return wrench


def weight_wrench(
    values: Mapping[str, float], rotation: np.ndarray, mass: float, centre: np.ndarray
) -> np.ndarray:
    """Force and moment about O_b of gravity and buoyancy, (6,)."""
    gravity = rotation.T @ [0.0, 0.0, values["water.gravity"]]
    weight = mass * gravity
    force = weight - values["mass.buoyancy"] * gravity
    return np.concatenate([force, cross_matrix(centre) @ weight])


def derivative(
    fish_values: Mapping[str, float],
    state13: Sequence[float] | np.ndarray,
    phase: float,
    inputs5: Sequence[float] | np.ndarray,
) -> np.ndarray:
    """d/dt of [x y z qw qx qy qz u v w p q r], (13,).

    Args:
        fish_values: number by path, as `FishParams.values()`.
        state13: (13,) SI, attitude scalar first.
        phase: tail phase, rad.
        inputs5: tail offset, amplitude (rad), frequency (Hz), block displacement (m) and
            angle (rad), all held.
    """
    state, inputs = np.asarray(state13, float), np.asarray(inputs5, float)
    attitude, velocity, spin = state[3:7], state[7:10], state[10:13]
    rotation = Rotation.from_quat(np.roll(attitude, -1)).as_matrix()
    mass, centre, inertia = mass_properties(fish_values, inputs[3], inputs[4])
    wrench = (
        tail_wrench(fish_values, velocity, spin, phase, inputs)
        + body_wrench(fish_values, velocity, spin)
        + weight_wrench(fish_values, rotation, mass, centre)
    )
    spin_x, centre_x = cross_matrix(spin), cross_matrix(centre)
    inertial_force = mass * (spin_x @ velocity + spin_x @ spin_x @ centre)
    inertial_moment = spin_x @ inertia @ spin + mass * centre_x @ spin_x @ velocity
    system = np.block([[mass * np.eye(3), -mass * centre_x], [mass * centre_x, inertia]])
    acceleration = np.linalg.solve(
        system, wrench - np.concatenate([inertial_force, inertial_moment])
    )
    turning = np.zeros((4, 4))
    turning[0, 1:], turning[1:, 0], turning[1:, 1:] = -spin, spin, -spin_x
    return np.concatenate([rotation @ velocity, 0.5 * turning @ attitude, acceleration])


def first_state(initial: Mapping[str, Any] | None) -> tuple[np.ndarray, float]:
    """State (13,) and tail phase at the start; what is not given is zero and level."""
    given = initial or {}
    roll, pitch, yaw = given.get("euler_roll_pitch_yaw", (0.0, 0.0, 0.0))
    attitude = np.roll(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(), 1)
    parts = (
        given.get("position_inertial", (0.0, 0.0, 0.0)),
        attitude,
        given.get("velocity_body", (0.0, 0.0, 0.0)),
        given.get("angular_velocity_body", (0.0, 0.0, 0.0)),
    )
    return np.concatenate([np.asarray(part, float) for part in parts]), given.get("tail_phase", 0.0)


def commands(schedule: Sequence[Mapping[str, float]]) -> list[tuple[float, np.ndarray]]:
    """Time and inputs (5,) of each row; a command that a row leaves out keeps its value."""
    rows, current = [], dict.fromkeys(INPUT_NAMES, 0.0)
    for row in schedule:
        current |= {name: row[name] for name in INPUT_NAMES if name in row}
        rows.append((float(row["t"]), np.array(list(current.values()), float)))
    return rows


def simulate(
    fish_values: Mapping[str, float],
    schedule: Sequence[Mapping[str, float]],
    duration_s: float,
    initial: Mapping[str, Any] | None,
    sample_times: Sequence[float] | np.ndarray,
) -> np.ndarray:
    """States at the sample times, (T, 13), each stretch of held commands integrated by itself.

    Args:
        fish_values: number by path, as `FishParams.values()`.
        schedule: rows with `t` (s) and the commands; the first row holds from the start.
        duration_s: end of the run, s.
        initial: `euler_roll_pitch_yaw`, `velocity_body`, `angular_velocity_body`,
            `position_inertial`, `tail_phase`; None is level, at rest, at the origin.
        sample_times: (T,) s, increasing, from 0 to the duration.
    """
    times, rows = np.asarray(sample_times, float), commands(schedule)
    start, phase = first_state(initial)
    state = np.append(start, phase)
    result = np.full((len(times), 13), np.nan)
    bounds = [0.0, *(at for at, _ in rows[1:] if at < duration_s), duration_s]
    for (begin, end), (_, held) in zip(pairwise(bounds), rows, strict=False):

        def rate(_: float, y: np.ndarray, held: np.ndarray = held) -> np.ndarray:
            return np.append(derivative(fish_values, y[:13], y[13], held), 2 * np.pi * held[2])

        inside = (times >= begin) & (times <= end)
        stops = np.union1d(times[inside], [begin, end])
        solution = solve_ivp(
            rate, (begin, end), state, "DOP853", t_eval=stops, rtol=1e-11, atol=1e-13
        )
        assert solution.success, solution.message
        result[inside] = solution.y[:13, np.isin(stops, times[inside])].T
        state = solution.y[:, -1]
    result[:, 3:7] /= np.linalg.norm(result[:, 3:7], axis=1, keepdims=True)
    result[:, 3:7] *= np.where(result[:, 3:4] < 0, -1.0, 1.0)
    return result


def write_golden() -> None:
    """Computes every case in tests/golden again and writes its CSV."""
    from fish_env.params.io import load_fish

    for case_file in sorted(GOLDEN.glob("*.json")):
        case = json.loads(case_file.read_text())
        fish = case["fish"]
        place = case_file.parent / fish if fish.endswith(".yaml") else fish
        times = np.arange(round(case["duration_s"] * 10) + 1) / 10
        states = simulate(
            load_fish(place).values(), case["schedule"], case["duration_s"], case["initial"], times
        )
        np.savetxt(
            case_file.with_suffix(".csv"),
            np.column_stack([times, states]),
            delimiter=",",
            fmt="%.15g",
            header=",".join(COLUMNS),
            comments="",
        )
        print(f"{case_file.stem}: {len(times)} samples")


if __name__ == "__main__":
    write_golden()
