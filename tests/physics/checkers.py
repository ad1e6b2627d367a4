"""What the model promises, as functions that fail on a model which breaks the promise.

``build`` is the simulator's class, or a maker of broken ones with the same arguments.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

import numpy as np

from fish_env.model.frames import euler_from_quaternion
from fish_env.params.schema import FishParams
from fish_env.simulator import InitialState, Simulator, schedule, time_grid
from tests import reference_model
from tests.physics.cases import (
    HOLD,
    SWIM,
    TUMBLE,
    dry,
    end_state,
    lopsided,
    mass_matrix,
    random_inputs,
    random_states,
    random_values,
    rotation,
    run_between,
    swimmer,
)

Build = Callable[..., Simulator]
Effects = Mapping[str, Mapping[str, float]]


def order_of(solve: Callable[[float], np.ndarray], dt: float) -> float:
    """Order of convergence observed with the steps dt, dt/2 and dt/4."""
    coarse, middle, fine = solve(dt), solve(dt / 2), solve(dt / 4)
    return float(np.log2(np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine)))


def check_order(build: Build, effects: Effects | None = None, dt: float = 0.01) -> None:
    """The classical Runge-Kutta scheme is of order four where the motion is smooth."""
    order = order_of(
        lambda step: end_state(build(swimmer(), step, effects), SWIM, 0.48, TUMBLE), dt
    )
    assert abs(order - 4) < 0.2, f"the observed order is {order:.2f}"


def check_order_through_switch(build: Build) -> None:
    """A command that switches within a run is met exactly, so the order survives it."""
    commands = [*SWIM, {"t": 0.237, "tail_amplitude": 0.2, "tail_offset": -0.2}]
    order = order_of(lambda step: end_state(build(swimmer(), step), commands, 0.48, TUMBLE), 0.01)
    assert abs(order - 4) < 0.2, f"the observed order is {order:.2f}"


def momenta(fish: FishParams, states: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, ...]:
    """Kinetic energy (T,), linear momentum and angular momentum about C_m, inertial, (T, 3)."""
    matrix = mass_matrix(fish, inputs)
    _, centre, _ = reference_model.mass_properties(fish.values(), inputs[3], inputs[4])
    generalised = states[:, 7:13] @ matrix
    energy = 0.5 * np.sum(states[:, 7:13] * generalised, axis=1)
    spin = generalised[:, 3:] - np.cross(centre, generalised[:, :3])
    turns = [rotation(state) for state in states]
    linear = np.array([turn @ p for turn, p in zip(turns, generalised[:, :3], strict=True)])
    angular = np.array([turn @ h for turn, h in zip(turns, spin, strict=True)])
    return energy, linear, angular


def drifts(build: Build, dt: float) -> np.ndarray:
    """How far energy and the two momenta drift in free flight, relative, (3,)."""
    fish = dry(lopsided())
    run = run_between(build(fish, dt), HOLD, 0.0, 1.0, TUMBLE)
    kept = momenta(fish, run.states, run.inputs[0])
    return np.array([np.linalg.norm(x[-1] - x[0]) / np.linalg.norm(x[0]) for x in kept])


def check_energy(build: Build) -> None:
    """Without water and gravity the kinetic energy stays, but for the integrator's error."""
    coarse, fine = drifts(build, 0.02)[0], drifts(build, 0.01)[0]
    assert fine < 1e-6, f"the energy drifts by {fine:.1e}"
    assert fine < coarse / 12, "the drift of the energy does not vanish with the step"


def check_momentum(build: Build) -> None:
    """Without water and gravity both momenta stay, although O_b accelerates about C_m."""
    coarse, fine = drifts(build, 0.02)[1:], drifts(build, 0.01)[1:]
    assert np.all(fine < 1e-6), f"the momenta drift by {fine}"
    assert np.all(fine < coarse / 12), "the drift of the momenta does not vanish with the step"


def check_total_energy(build: Build) -> None:
    """With gravity and buoyancy alone, kinetic and potential energy sum to a constant."""
    fish = dry(lopsided(), gravity=9.81).replace({"mass.buoyancy": 1.98})
    run = build(fish, 0.005).run(HOLD, duration_s=1.0, initial=TUMBLE)
    kinetic, _, _ = momenta(fish, run.states, run.inputs[0])
    mass, centre, _ = reference_model.mass_properties(fish.values(), *run.inputs[0, 3:5])
    depth = np.array([state[2] + (rotation(state) @ centre)[2] for state in run.states])
    total = kinetic - 9.81 * (mass * depth - fish.get("mass.buoyancy") * run.states[:, 2])
    assert np.ptp(kinetic) > 1e-2, "nothing was exchanged"
    assert np.ptp(total) < 1e-7, f"the total energy drifts by {np.ptp(total):.1e} J"


MIRRORED = ("y", "qx", "qz", "v", "p", "r")


def check_mirror(build: Build, effects: Effects | None = None) -> None:
    """A fish with a plane of symmetry, mirrored commands and start: a mirrored trajectory."""
    mirror = {"tail_offset": -1.0, "block_angle": -1.0}
    other = [{key: value * mirror.get(key, 1.0) for key, value in row.items()} for row in SWIM]
    roll, pitch, yaw = TUMBLE.euler
    (x, y, z), (u, v, w), (p, q, r) = (
        TUMBLE.position,
        TUMBLE.velocity_body,
        TUMBLE.angular_velocity_body,
    )
    image = InitialState(
        (x, -y, z), (-roll, pitch, -yaw), (u, -v, w), (-p, q, -r), TUMBLE.tail_phase + np.pi
    )
    simulator = build(swimmer(), 0.01, effects)
    one = simulator.run(SWIM, duration_s=1.0, initial=TUMBLE)
    two = simulator.run(other, duration_s=1.0, initial=image)
    for name in ("x", "y", "z", "qw", "qx", "qy", "qz", "u", "v", "w", "p", "q", "r"):
        sign = -1.0 if name in MIRRORED else 1.0
        np.testing.assert_allclose(two[name], sign * one[name], atol=1e-10, err_msg=name)


CURRENT = {"north": 0.12, "east": -0.2, "down": 0.07}


def check_galilean(build: Build, effects: Effects | None = None) -> None:
    """In a uniform current a fish moves as in still water, carried along."""
    flow = np.array(list(CURRENT.values()))
    still_effects = {**(effects or {}), "current": {"north": 0.0}}
    still = build(lopsided(), 0.0025, still_effects).run(SWIM, duration_s=1.0, initial=TUMBLE)
    turn = rotation(still.states[0])
    carried = InitialState(
        TUMBLE.position,
        TUMBLE.euler,
        tuple(np.array(TUMBLE.velocity_body) + turn.T @ flow),
        TUMBLE.angular_velocity_body,
        TUMBLE.tail_phase,
    )
    moving = build(lopsided(), 0.0025, {**(effects or {}), "current": CURRENT}).run(
        SWIM, duration_s=1.0, initial=carried
    )
    expected = still.states[:, :3] + still.time_s[:, None] * flow
    np.testing.assert_allclose(moving.states[:, :3], expected, atol=1e-8)
    np.testing.assert_allclose(moving.states[:, 3:7], still.states[:, 3:7], atol=1e-8)
    for over_ground, through in zip(moving.states, still.states, strict=True):
        drift = over_ground[7:10] - rotation(over_ground).T @ flow
        np.testing.assert_allclose(drift, through[7:10], atol=1e-8)


def tail_flow(fish: FishParams, state: np.ndarray, inputs: np.ndarray, angle: float, rate: float):
    """Velocity of the tail's centre of pressure through still water (m/s, body)."""
    root = reference_model.triple(fish.values(), "tail.root")
    arm = -fish.get("tail.center_of_pressure") * np.array([np.cos(angle), np.sin(angle), 0.0])
    return state[7:10] + np.cross(state[10:13], root + arm) + np.cross([0, 0, rate], arm)


def check_drag_power(build: Build) -> None:
    """Drag and damping never put energy into the motion; lift neither adds nor takes any."""
    rng = np.random.default_rng(3)
    fish = lopsided()
    simulator = build(fish, 0.01)
    for state, inputs in zip(random_states(rng, 30), random_inputs(rng, 30), strict=True):
        terms = simulator.wrench_by_term(state, inputs)
        tail = inputs[0] + inputs[1] * np.sin(state[13])
        tail_rate = 2 * np.pi * inputs[2] * inputs[1] * np.cos(state[13])
        flow = tail_flow(fish, state, inputs, tail, tail_rate)
        power = {name: state[7:10] @ terms[name][:3] for name in terms if name[:2] in ("xz", "xy")}
        power |= {name: flow @ terms[name][:3] for name in ("tail_drag", "tail_lift")}
        power["damping"] = state[10:13] @ terms["damping"][3:]
        for name, value in power.items():
            if name.endswith("lift"):
                assert abs(value) < 1e-12, f"{name} does work: {value:.2e} W"
            else:
                assert value < 0, f"{name} adds power: {value:.2e} W"


def check_trim(build: Build) -> None:
    """At rest the centre of mass hangs below O_b: both angles in closed form.

    Nothing but gravity has a moment about O_b at rest, and C_m x R^T g vanishes where C_m points
    down: tan(theta) = -C_mx / sqrt(C_my^2 + C_mz^2), tan(phi) = C_my / C_mz.
    """
    fish = swimmer()
    _, centre, _ = reference_model.mass_properties(fish.values(), 0.002, 0.3)
    hold = [{"t": 0.0, "block_displacement": 0.002, "block_angle": 0.3}]
    end = run_between(build(fish, 0.02), hold, 0.0, 25.0, InitialState()).states[-1]
    roll, pitch, _ = euler_from_quaternion(end[3:7])
    assert abs(pitch + np.arctan2(centre[0], np.hypot(centre[1], centre[2]))) < 1e-3
    assert abs(roll - np.arctan2(centre[1], centre[2])) < 1e-3


def check_reference_derivative(build: Build) -> None:
    """Accelerations equal those of the independent implementation, for different fish."""
    rng = np.random.default_rng(11)
    for _ in range(3):
        fish = swimmer().replace(random_values(rng))
        simulator = build(fish, 0.01)
        for state, inputs in zip(random_states(rng, 10), random_inputs(rng, 10), strict=True):
            expected = reference_model.derivative(fish.values(), state[:13], state[13], inputs)
            actual = simulator.state_derivative(state, inputs)[:13]
            scale = 1e-11 * (1 + np.abs(expected).max())
            np.testing.assert_allclose(actual, expected, rtol=0, atol=scale)


def check_golden(build: Build, dt: float = 0.01, atol: float = 2e-4) -> None:
    """Trajectories equal those that the independent implementation has computed."""
    for file in sorted(reference_model.GOLDEN.glob("*.json")):
        case = json.loads(file.read_text())
        place = file.parent / case["fish"] if case["fish"].endswith(".yaml") else case["fish"]
        table = np.loadtxt(file.with_suffix(".csv"), delimiter=",", skiprows=1)
        given = case["initial"] or {}
        start = InitialState(
            given.get("position_inertial", (0.0, 0.0, 0.0)),
            given.get("euler_roll_pitch_yaw", (0.0, 0.0, 0.0)),
            given.get("velocity_body", (0.0, 0.0, 0.0)),
            given.get("angular_velocity_body", (0.0, 0.0, 0.0)),
            given.get("tail_phase", 0.0),
        )
        run = build(place, dt).run(case["schedule"], initial=start, sample_times_s=table[:, 0])
        states = run.states[:, :13] * np.where(run.states[:, 3:4] < 0, -1.0, 1.0) ** SIGNED
        np.testing.assert_allclose(states, table[:, 1:], rtol=0, atol=atol, err_msg=file.stem)


SIGNED = np.isin(np.arange(13), (3, 4, 5, 6)).astype(float)
"""1 for the quaternion, whose sign is free."""


def check_scalar_equals_batch(
    build: Build, count: int, threads: int = 1, effects: Effects | None = None, steps: int = 30
) -> None:
    """A fish moves alike alone and in a batch of different fish, to the last bit."""
    rng = np.random.default_rng(count)
    fish = swimmer()
    factor = rng.uniform(0.9, 1.1, count)
    changes = {path: fish.get(path) * factor for path in ("body.area[1]", "tail.area")}
    model = build(fish, 0.01, effects).model
    kernels = model.kernels
    commands = schedule([*SWIM, {"t": 0.11, "tail_offset": -0.2, "block_angle": -0.3}])
    grid, starts = time_grid(np.array([0.0, 0.01 * steps]), commands.times_s, 0.01)
    state = np.zeros((len(kernels.state_names), count))
    state[:18] = random_states(rng, count).T
    inputs = np.repeat(commands.at([0.0]).T, count, axis=1)
    record = model.records(changes)
    kernels.initialise(state, inputs, record, np.zeros(count))
    together, failed = state.copy(), np.full(count, np.inf)

    def advance(columns: np.ndarray, lanes: slice) -> None:
        kernels.advance(
            columns,
            inputs[:, lanes].copy(),
            record[:, lanes].copy(),
            np.full((5, columns.shape[1]), np.inf),
            np.zeros(columns.shape[1]),
            commands.at(starts)[:, :, None].copy(),
            grid,
            tables=model.tables,
            failed_at=failed[lanes],
            threads=threads,
        )

    advance(together, slice(None))
    assert np.all(np.isinf(failed))
    assert not np.array_equal(together, state)
    for lane in sorted({0, 1, count // 2, count - 1} & set(range(count))):
        alone = state[:, lane : lane + 1].copy()
        advance(alone, slice(lane, lane + 1))
        assert alone.tobytes() == together[:, lane : lane + 1].tobytes(), f"fish {lane} of {count}"
