"""The reactive tail against the water's impulse, taken numerically, and Lighthill's closed form."""

from functools import partial

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.broken import broken_simulator
from tests.physics.cases import lopsided, mass_matrix, random_states, rotation, swimmer
from tests.reference_model import cross_matrix, triple

SCALE = 0.8
EFFECTS = {"tail_reactive": {"scale": SCALE}}
FLOW = {"north": 0.15, "east": -0.1, "down": 0.2}
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


def strip_of(fish):
    """Length (m) and virtual mass per length (kg/m): rho pi depth^2 / 4, depth = S_t / length."""
    length = 2 * fish.get("tail.center_of_pressure")
    depth = fish.get("tail.area") / length
    return length, SCALE * np.pi / 4 * fish.get("water.density") * depth**2


class MovingTail:
    """The tail in the frame of the water, as a function of the time since now.

    The body's pose follows its present velocities and accelerations to second order, which is all
    that the rate of change of an impulse depends on.
    """

    def __init__(self, fish, state, inputs, slope, flow):
        self.fish, self.inputs, self.flow = fish, inputs, flow
        self.turn, self.velocity, self.spin = rotation(state), state[7:10], state[10:13]
        self.phase = state[13]
        self.acceleration, self.spin_rate = slope[7:10], slope[10:13]
        self.length, self.mass = strip_of(fish)

    def attitude(self, t):
        angle = self.spin * t + 0.5 * self.spin_rate * t**2
        size = np.linalg.norm(angle)
        axis = cross_matrix(angle / size) if size else np.zeros((3, 3))
        return self.turn @ (np.eye(3) + np.sin(size) * axis + (1 - np.cos(size)) * axis @ axis)

    def hull(self, t):
        """Position of O_b."""
        change = self.acceleration + np.cross(self.spin, self.velocity)
        return self.turn @ (self.velocity * t + 0.5 * change * t**2) - self.flow * t

    def angle(self, t):
        offset, amplitude, frequency = self.inputs[:3]
        return offset + amplitude * np.sin(self.phase + 2 * np.pi * frequency * t)

    def point(self, sigma, t):
        angle = self.angle(t)
        aft = np.array([-np.cos(angle), -np.sin(angle), 0.0])
        root = triple(self.fish.values(), "tail.root")
        return self.hull(t) + self.attitude(t) @ (root + sigma * aft)

    def normal(self, t):
        angle = self.angle(t)
        return self.attitude(t) @ np.array([-np.sin(angle), np.cos(angle), 0.0])

    def aft(self, t):
        angle = self.angle(t)
        return self.attitude(t) @ np.array([-np.cos(angle), -np.sin(angle), 0.0])

    def across(self, sigma, t):
        """Normal velocity w of a section (m/s)."""
        return self.normal(t) @ slope_of(lambda s: self.point(sigma, s), t)

    def impulse(self, t):
        """Impulse of the water and its moment about the origin, (6,)."""
        total = np.zeros(6)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            sigma = 0.5 * self.length * (1 + node)
            momentum = 0.5 * self.length * weight * self.mass * self.across(sigma, t)
            momentum = momentum * self.normal(t)
            total += np.concatenate([momentum, np.cross(self.point(sigma, t), momentum)])
        return total

    def energy(self, t):
        """Kinetic energy of the water (J)."""
        sigma = 0.5 * self.length * (1 + NODES)
        squares = np.array([self.across(s, t) ** 2 for s in sigma])
        return 0.25 * self.length * self.mass * WEIGHTS @ squares

    def tip(self):
        """Velocity of the tip along the tail, forward, and across it (m/s)."""
        velocity = slope_of(lambda s: self.point(self.length, s), 0.0)
        return -self.aft(0.0) @ velocity, self.normal(0.0) @ velocity

    def wrench(self):
        """What the tail feels about O_b, body frame: impulse lost by the body, and the tip."""
        along, across = self.tip()
        force = -self.mass * along * across * self.normal(0.0)
        force = force - 0.5 * self.mass * across**2 * self.aft(0.0)
        at_tip = np.concatenate([force, np.cross(self.point(self.length, 0.0), force)])
        total = at_tip - slope_of(self.impulse, 0.0)
        return np.concatenate([self.turn.T @ total[:3], self.turn.T @ total[3:]])


def slope_of(function, t, h=2e-3):
    """Derivative from central differences of fourth order."""
    far = function(t + 2 * h) - function(t - 2 * h)
    return (8 * (function(t + h) - function(t - h)) - far) / (12 * h)


def cases(count, build=Simulator):
    """The moving tail, and the reactive wrench that the model has at work, in random states."""
    rng = np.random.default_rng(7)
    fish = lopsided()
    simulator = build(fish, effects={**EFFECTS, "current": FLOW})
    for state in random_states(rng, count):
        inputs = rng.uniform([-0.5, 0, 0.5, -0.01, -0.5], [0.5, 0.5, 2.5, 0.01, 0.5])
        slope = simulator.state_derivative(state, inputs)
        terms = simulator.wrench_by_term(state, inputs)
        # The inertia of the water is on the left-hand side of M a = sum of terms.
        in_matrix = sum(terms.values()) - mass_matrix(fish, inputs) @ slope[7:13]
        tail = MovingTail(fish, state, inputs, slope, np.array(list(FLOW.values())))
        yield tail, terms["tail_reactive"] - in_matrix


def check_impulse(build):
    for tail, wrench in cases(12, build):
        scale = 1e-5 * (1 + np.abs(wrench).max())
        np.testing.assert_allclose(wrench, tail.wrench(), atol=scale)


def test_the_wrench_is_the_rate_of_the_waters_impulse():
    """Differenced numerically in the inertial frame, for moving, turning, accelerating bodies."""
    check_impulse(Simulator)


@pytest.mark.parametrize(
    "wrong",
    [
        "motion, tail._replace(acceleration=0.0), inputs",
        "motion._replace(water_u=0.0), tail, inputs",
        "motion._replace(p=0.0), tail, inputs",
    ],
)
def test_the_impulse_check_notices_a_missing_term(wrong):
    """Without the beat's acceleration, the turning of the flow, or a convected part, it fails."""
    replacements = {"tail_reactive_wrench(motion, tail, inputs": f"tail_reactive_wrench({wrong}"}
    check_impulse(partial(broken_simulator, {}))
    with pytest.raises(AssertionError):
        check_impulse(partial(broken_simulator, replacements))


def test_power_goes_into_the_waters_energy_and_the_wake():
    """F.V + M.omega + hinge power = -dT/dt - 1/2 m w^2 u at the tip: nothing from nowhere."""
    for tail, wrench in cases(12):
        flow = tail.turn.T @ tail.flow
        root = triple(tail.fish.values(), "tail.root")
        hinge = wrench[5] - np.cross(root, wrench[:3])[2]
        rate = slope_of(tail.angle, 0.0)
        power = wrench[:3] @ (tail.velocity - flow) + wrench[3:] @ tail.spin + hinge * rate
        along, across = tail.tip()
        lost = slope_of(tail.energy, 0.0) + 0.5 * tail.mass * across**2 * along
        assert power == pytest.approx(-lost, abs=1e-5 * (1 + abs(lost)))


def mean_thrust(amplitude, frequency, speed):
    """Mean forward force of a tail that beats on a body held in a stream (N)."""
    simulator = Simulator(swimmer(), effects=EFFECTS)
    phases = 2 * np.pi * np.arange(32) / 32
    inputs = [0.0, amplitude, frequency, 0.0, 0.0]
    state = np.zeros(14)
    state[3], state[7] = 1.0, speed
    forces = []
    for phase in phases:
        state[13] = phase
        forces.append(simulator.wrench_by_term(state, inputs)["tail_reactive"][0])
    return np.mean(forces)


@pytest.mark.parametrize(("frequency", "speed"), [(2.0, 0.3), (1.0, 0.0), (0.3, 0.4)])
def test_the_mean_thrust_tends_to_lighthills(frequency, speed):
    """Small beats: 1/2 m (<h_t^2> - U^2 <h_x^2>) at the tip; the error falls as amplitude squared.

    With h = -L xi at the tip and slope h_x = xi, the means are (L omega A)^2 / 2 and A^2 / 2. A
    slow beat in a fast stream brakes.
    """
    length, mass = strip_of(swimmer())
    errors = []
    for amplitude in (0.08, 0.04, 0.02):
        swing = (length * 2 * np.pi * frequency) ** 2 - speed**2
        expected = 0.25 * mass * swing * amplitude**2
        errors.append(mean_thrust(amplitude, frequency, speed) / expected - 1)
    assert abs(errors[2]) < 1e-2
    np.testing.assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 4.0, rtol=0.05)


def test_the_mass_matrix_stays_symmetric_and_positive_definite():
    """Its added part is the water's kinetic energy: the same for any tail angle, never negative."""
    simulator = Simulator(swimmer(), effects=EFFECTS)
    rng = np.random.default_rng(1)
    length, mass = strip_of(swimmer())
    for angle in rng.uniform(-1, 1, 10):
        state = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], float)
        inputs = np.array([angle, 0.0, 0.0, 0.0, 0.0])
        acceleration = simulator.state_derivative(state, inputs)[7:13]
        total = sum(simulator.wrench_by_term(state, inputs).values())
        normal = np.array([-np.sin(angle), np.cos(angle), 0.0])
        root = triple(swimmer().values(), "tail.root")
        e0 = np.concatenate([normal, np.cross(root, normal)])
        e1 = np.array([0, 0, 0, 0, 0, -1.0])
        mixed = length**2 / 2 * (np.outer(e0, e1) + np.outer(e1, e0))
        added = mass * (length * np.outer(e0, e0) + mixed + length**3 / 3 * np.outer(e1, e1))
        np.testing.assert_allclose(
            (mass_matrix(swimmer(), inputs) + added) @ acceleration, total, atol=1e-12
        )


def test_the_force_scales_with_its_factor_and_the_square_of_the_beat():
    """Linear in scale; at rest, quadratic in frequency."""
    state, inputs = [0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.7], [0.1, 0.3, 1.0, 0, 0]
    one = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state, inputs)["tail_reactive"]
    double = {"tail_reactive": {"scale": 2 * SCALE}}
    two = Simulator(swimmer(), effects=double).wrench_by_term(state, inputs)["tail_reactive"]
    inputs[2] = 2.0
    fast = Simulator(swimmer(), effects=EFFECTS).wrench_by_term(state, inputs)["tail_reactive"]
    np.testing.assert_allclose(two, 2 * one, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(fast, 4 * one, rtol=1e-12, atol=1e-15)
