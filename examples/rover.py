"""A vehicle of one's own for the inference: a rover that drives straight ahead."""

from dataclasses import dataclass

import numpy as np

from fish_env.inference.effects import DeclaredEffect, EffectParameter
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Problem
from fish_env.inference.vehicle import Coefficients

MASS = 10.0
EFFECTS = (
    DeclaredEffect("headwind", (EffectParameter("force", "N", 0.0, plausible=(-2.0, 2.0)),)),
    DeclaredEffect("air_drag", (EffectParameter("k", "kg/m", 0.0, 0.0, 9.0, (0.1, 1.0)),)),
)
WIND = EffectParameterId("headwind", "force")
AIR = EffectParameterId("air_drag", "k")


@dataclass(frozen=True)
class White:
    """Noise: a standard deviation (m/s)."""

    sd: float

    def is_close(self, other, share):
        """Whether another one differs by less than a share."""
        return abs(other.sd - self.sd) < share * self.sd


@dataclass(frozen=True)
class Evaluated:
    """One run evaluated: log likelihood, and whitened residuals (T,)."""

    log_likelihood: float
    residuals: np.ndarray


class Rover(Problem):
    """Runs of a rover: clock (T,) s, throttle (R, T) from -1 to 1, speed (R, T) in m/s."""

    known = {effect.name: effect for effect in EFFECTS}  # noqa: RUF012

    def __init__(self, clock, throttle, speed):
        self.clock, self.throttle, self.speed = clock, throttle, speed
        low, high = np.array([0.1, 0.1]), np.array([99.0, 99.0])
        self.baseline = Coefficients(
            ("thrust", "drag"), np.array([8.0, 2.0]), np.diag([0.8, 0.3]) ** 2, (low, high)
        )

    @property
    def longest_step(self):
        """Simulation step (s)."""
        return self.clock[1]

    @property
    def longest_run(self):
        """Length of a run (s)."""
        return self.clock[-1]

    @property
    def run_count(self):
        """Number of runs."""
        return len(self.speed)

    def groups(self):
        """Run and time (s) of each residual."""
        runs, samples = self.speed.shape
        return np.repeat(np.arange(runs), samples), np.tile(self.clock, runs)

    def some(self, runs):
        """Return the same problem on some of its runs."""
        return Rover(self.clock, self.throttle[list(runs)], self.speed[list(runs)])

    def innovations(self, z, effects, noise, filtered, push=0.0):
        """Simulate N rovers at once; return their whitened residuals (N, R T)."""
        thrust, drag = self.baseline.values(z)[:, :, None]
        zero = np.zeros((z.shape[1], 1))
        wind = effects.get(WIND, zero).reshape(-1, 1)
        air = effects.get(AIR, zero).reshape(-1, 1)
        push = np.broadcast_to(push, (z.shape[1], *self.speed.shape))
        u = np.repeat(self.speed[None, :, 0], z.shape[1], axis=0)
        simulated = []
        for k in range(len(self.clock)):
            simulated.append(u)
            force = thrust * self.throttle[:, k] - drag * u - air * u * abs(u) - wind
            u = u + self.longest_step * (force + push[:, :, k]) / MASS
        errors = self.speed - np.stack(simulated, axis=2)
        return errors.reshape(len(errors), -1) / noise.sd

    def filtered(self, point, noise, near=()):
        """Evaluate each run at one point."""
        effects = {id: np.array([value]) for id, value in point.effects.items()}
        rows = self.innovations(point.z[:, None], effects, noise, ())
        runs = rows.reshape(self.speed.shape)
        return [Evaluated(-0.5 * r @ r - len(r) * np.log(noise.sd), r) for r in runs]

    def default_noise(self):
        """The speedometer's data sheet."""
        return White(0.05)

    def fitted_noise(self, point, noise, final, filtered, leverage):
        """Return the likeliest noise: the root mean square of the errors."""
        residuals = np.concatenate([own.residuals for own in self.filtered(point, noise)])
        return White(noise.sd * float(np.sqrt(np.mean(residuals**2))))

    def generic_terms(self, fit):
        """Forces that the adequacy test adds one at a time."""
        return Forces(self, fit)


class Forces:
    """Forces of 0.1 N (root mean square) that depend on time, throttle or speed."""

    def __init__(self, rover, fit):
        self.rover, self.fit = rover, fit
        time = np.broadcast_to(rover.clock, rover.speed.shape)
        self.functions = {"time": time, "throttle": rover.throttle, "speed^3": rover.speed**3}
        self.columns = np.arange(len(self.functions))

    def words(self, column):
        """Function and direction."""
        return list(self.functions)[column], "ahead"

    def swings(self, column):
        """Whether the force swings with the drive. None does."""
        return False

    def unit(self, column):
        """Size (N)."""
        return 0.1

    def changes(self, columns):
        """Change of the residuals, (D, N)."""
        values = [list(self.functions.values())[i] for i in columns]
        push = [0.1 * f / np.sqrt(np.mean(f**2)) for f in values]
        push = np.array([np.zeros_like(push[0]), *push])
        point, fit = self.fit.point, self.fit
        z = np.repeat(point.z[:, None], len(push), axis=1)
        effects = {id: np.full(len(push), value) for id, value in point.effects.items()}
        rows = self.rover.innovations(z, effects, fit.noise, fit.filtered, push)
        return (rows[1:] - rows[0]).T
