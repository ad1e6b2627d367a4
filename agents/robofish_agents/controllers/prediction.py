"""Predicts the costs of candidate actions over a horizon with a model of the fish.

All candidates of all fish are advanced in one call of the batched physics. Two simplifications:
goals go on as they change now, and the tail beat over which heading and speed are averaged keeps
its present length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fish_env.arrays import BoolArray, FloatArray
from fish_env.envs.config import load_env_config
from fish_env.envs.layout import MAX_BEAT_S
from fish_env.simulator import Simulator, time_grid
from robofish_agents.controllers.seen import Seen

FAILURE_COST = 5.0
"""For each step that ends outside the tank or diverged."""
MOMENT, LIFT = "mass.static_moment_rest[0]", "mass.buoyancy"
UNKNOWNS = (MOMENT, LIFT, "tail offset")
"""What may differ from the model: trim (kg m), net buoyancy (kg), the tail's zero (rad)."""
WATCHED = ("q", "w", "r")
"""States that show the unknowns, one each."""
INTEGRALS = ("heading_cosine_integral", "heading_sine_integral", "surge_integral")


@dataclass(frozen=True)
class Costs:
    """Costs of errors: weight (sqrt(1 + (e/margin)^2) - 1), quadratic near zero, then linear.

    Attributes:
        weights: of depth, heading and speed errors.
        margins: error (m, rad, m/s) beyond which a cost is about a line.
        power: cost per W of tail power.
        change: cost of a change of an action by one, squared.
    """

    weights: tuple[float, float, float] = (0.4, 0.4, 0.2)
    margins: tuple[float, float, float] = (0.05, 0.10, 0.02)
    power: float = 0.2
    change: float = 0.02

    def of(self, errors: FloatArray) -> FloatArray:
        """Returns the cost of depth, heading and speed errors (3, ...)."""
        shape = (3,) + (1,) * (errors.ndim - 1)
        scaled = errors / np.reshape(self.margins, shape)
        terms = np.sqrt(1.0 + scaled**2) - 1.0
        return np.asarray(np.tensordot(self.weights, terms, axes=1))


class Prediction:
    """Predicts with the model of one fish, even if another fish swims.

    Args:
        fish: name or file of the fish whose model is used.
        steps: steps of the horizon.
        stride: control periods in one of them.
        dt: physics step (s); it may be coarser than the environment's.
        costs: what errors cost.
    """

    def __init__(self, fish: str, steps: int, stride: int, dt: float, costs: Costs) -> None:
        self.config = config = load_env_config()
        self.steps, self.costs = steps, costs
        self.period = stride * config.control_period
        self._model = Simulator(fish, dt).model
        times = np.linspace(0.0, steps * self.period, steps + 1)
        self._grid, _ = time_grid(times, np.asarray(times[1:-1], float), dt)
        self._one_step, _ = time_grid(np.array([0.0, config.control_period]), np.zeros(0), dt)
        self._middle = (config.low + config.high) / 2
        self._half = (config.high - config.low) / 2
        names = self._model.kernels.state_names
        self._first_row = names.index("z")
        self._rows = {name: i - self._first_row for i, name in enumerate(names)}

    def total(self, seen: Seen, actions: FloatArray, unknown: FloatArray) -> FloatArray:
        """Returns the costs (steps, N, K) of actions.

        Args:
            seen: what N fish see.
            actions: (steps, N, K, 5), K candidates for each.
            unknown: (len(UNKNOWNS), N) how each fish differs from the model.
        """
        trace, failed = self._swim(seen, actions, unknown)
        cost = self.costs.of(self._errors(seen, trace))
        power = np.diff(trace[:, self._rows["tail_energy"]], axis=0) / self.period
        last = np.broadcast_to(seen.last_action[None, :, None], actions[:1].shape)
        change = np.diff(actions, axis=0, prepend=last)
        cost += self.costs.power * power
        cost += self.costs.change * np.einsum("hnkj,hnkj->hnk", change, change)
        return np.asarray(cost + FAILURE_COST * failed)

    def watched_after(self, seen: Seen, actions: FloatArray, unknown: FloatArray) -> FloatArray:
        """Returns the watched states (3, N) one control period after actions (N, 5)."""
        trace, _ = self._swim(seen, actions[None, :, None], unknown)
        return np.asarray(trace[1, [self._rows[name] for name in WATCHED], :, 0])

    def _swim(
        self, seen: Seen, actions: FloatArray, unknown: FloatArray
    ) -> tuple[FloatArray, BoolArray]:
        """Returns states from depth on, (steps + 1, rows, N, K), and where they are failures."""
        steps, fish, candidates, _ = actions.shape
        lanes = fish * candidates
        start = np.repeat(self._state(seen), candidates, axis=1)
        commands = self._middle + self._half * actions
        inputs = self._middle + self._half * seen.actuators
        commands[..., 0] += unknown[2][:, None]
        inputs[:, 0] += unknown[2]
        failed_at = np.full(lanes, np.inf)
        trace = np.empty((steps, len(start) - self._first_row, lanes))
        first = start[self._first_row :].copy()
        self._model.kernels.advance(
            start,
            np.repeat(inputs.T, candidates, axis=1),
            np.repeat(self._records(unknown), candidates, axis=1),
            np.repeat(self.config.slew[:, None], lanes, axis=1),
            np.zeros(lanes),
            np.ascontiguousarray(commands.reshape(steps, lanes, 5).transpose(0, 2, 1)),
            self._one_step if steps == 1 else self._grid,
            tables=self._model.tables,
            failed_at=failed_at,
            trace=trace,
            trace_row=self._first_row,
        )
        whole = np.concatenate([first[None], trace]).reshape(steps + 1, -1, fish, candidates)
        depth = whole[1:, self._rows["z"]]
        outside = (depth < self.config.top) | (depth > self.config.bottom)
        return whole, outside | np.isfinite(failed_at).reshape(fish, candidates)

    def _records(self, unknown: FloatArray) -> FloatArray:
        fish = self._model.fish
        changed = {name: fish.get(name) + unknown[i] for i, name in enumerate((MOMENT, LIFT))}
        return self._model.records(changed)

    def _state(self, seen: Seen) -> FloatArray:
        """Returns the observed states (states, N); headings are relative to the present goal."""
        names = self._model.kernels.state_names
        euler = np.stack([-seen.heading_error_instant, seen.pitch, seen.roll], axis=1)
        rows = {
            "z": seen.depth(self.config.top, self.config.bottom),
            "u": seen.surge,
            "v": seen.sway,
            "w": seen.heave,
            "p": seen.roll_rate,
            "q": seen.pitch_rate,
            "r": seen.yaw_rate,
            "tail_phase": seen.tail_phase,
        }
        turned = Rotation.from_euler("ZYX", euler).as_quat(scalar_first=True).T
        rows |= dict(zip(("qw", "qx", "qy", "qz"), turned, strict=True))
        state = np.zeros((len(names), len(seen.surge)))
        for name, values in rows.items():
            state[names.index(name)] = values
        return state

    def _errors(self, seen: Seen, trace: FloatArray) -> FloatArray:
        """Returns depth, heading and speed errors after each step, (3, steps, N, K)."""
        ahead = self.period * np.arange(1, self.steps + 1)[:, None]
        depth = trace[:, self._rows["z"]]
        goal_depth = depth[0, :, 0] + seen.depth_error + seen.goal_depth_rate * ahead
        cosine, sine, speed = self._beat_means(seen, trace)
        heading = (seen.goal_heading_rate * ahead)[:, :, None] - np.arctan2(sine, cosine)
        return np.stack(
            [
                goal_depth[:, :, None] - depth[1:],
                (heading + np.pi) % (2.0 * np.pi) - np.pi,
                seen.goal_speed[:, None] - speed,
            ]
        )

    def _beat_means(self, seen: Seen, trace: FloatArray) -> FloatArray:
        """Cosine and sine of the heading, and the surge speed, over a beat: (3, steps, N, K).

        Past values are assumed to equal the observed means.
        """
        first = self._rows[INTEGRALS[0]]
        integrals = trace[:, first : first + len(INTEGRALS)]
        speed = seen.goal_speed - seen.speed_error
        past = np.stack([np.cos(-seen.heading_error), np.sin(-seen.heading_error), speed])
        frequency = self._middle[2] + self._half[2] * seen.actuators[:, 2]
        window = np.minimum(1.0 / np.maximum(frequency, 1e-9), MAX_BEAT_S) / self.period
        begin = np.arange(1, self.steps + 1)[:, None] - window
        whole = np.floor(begin)
        at = np.clip(whole, 0, self.steps - 1).astype(int)
        share = np.where(begin > 0, begin - whole, 0.0)[:, :, None, None]
        lane = np.arange(len(window))
        # Indices on both sides of a slice come first: (steps, N, 3, K).
        early = integrals[at, :, lane] * (1.0 - share) + integrals[at + 1, :, lane] * share
        before = (np.minimum(begin, 0.0) * self.period)[:, :, None] * past.T
        spans = integrals[1:].transpose(0, 2, 1, 3) - early - before[:, :, :, None]
        per_second = 1.0 / (window * self.period)
        return np.asarray((spans * per_second[:, None, None]).transpose(2, 0, 1, 3))
