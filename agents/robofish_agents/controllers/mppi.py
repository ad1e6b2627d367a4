"""MPPI: sampling model-predictive control with the batched physics.

Each control step, candidates around the last plan are simulated over a horizon, and the new plan is
their mean, weighted by the exponential of their cost (Williams et al., "Information-Theoretic
Model Predictive Control", IEEE Transactions on Robotics 34, 2018). A plan is a few knots with
straight lines between, so that few candidates are enough. The error of the last prediction corrects
the estimates of trim, buoyancy and the zero of the tail.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray
from robofish_agents.controllers.prediction import UNKNOWNS, Costs, Prediction
from robofish_agents.controllers.seen import Seen

Float32Array = npt.NDArray[np.float32]
SENSITIVITY = np.array([-95.0, -0.476, -0.56])
"""Change of pitch rate, heave speed and yaw rate in 0.1 s per kg m, kg and rad of the unknowns, of
the fish zheng-2021-a at 0.1 m/s."""
UNKNOWN_LIMITS = np.array([0.002, 0.006, 0.15])
"""Largest values believed (kg m, kg, rad)."""


@dataclass(frozen=True)
class MPPISettings:
    """Settings of MPPI.

    Attributes:
        candidates: sequences simulated in each control step.
        steps: steps of the horizon.
        stride: control periods in one of them.
        knots: points of a plan, evenly spaced over the horizon.
        spread: (5,) standard deviation of a knot of each action.
        temperature: costs are compared in units of this share of their standard deviation.
        final: weight of the last step.
        learning: (3,) share of the prediction error that corrects each unknown.
        start: (5,) action of the first plan.
        dt: physics step of the prediction (s).
        costs: what errors cost.
        seed: seed of the candidates.
    """

    candidates: int = 64
    steps: int = 20
    stride: int = 2
    knots: int = 7
    spread: tuple[float, ...] = (0.35, 0.1, 0.2, 0.35, 0.0)
    temperature: float = 0.2
    final: float = 5.0
    learning: tuple[float, ...] = (0.1, 0.03, 0.01)
    start: tuple[float, ...] = (0.0, 0.2, 0.35, 0.0, 0.0)
    dt: float = 0.05
    costs: Costs = field(default_factory=Costs)
    seed: int = 0


class MPPIController:
    """Controls a batch of fish. All use the same random candidates, around their own plans.

    Args:
        fish: name or file of the fish whose model is used.
        settings: see :class:`MPPISettings`.
    """

    def __init__(self, fish: str = "zheng-2021-a", settings: MPPISettings | None = None) -> None:
        self.settings = given = settings or MPPISettings()
        self._prediction = Prediction(fish, given.steps, given.stride, given.dt, given.costs)
        # The first knot is the action of now; a step's action is that of its middle.
        length = given.steps * given.stride / (given.knots - 1)
        middles = (np.arange(given.steps) + 0.5) * given.stride - 0.5
        self._to_steps = _hat(np.asarray(middles / length, float), given.knots)
        self._shift = _hat(np.arange(given.knots, dtype=float) + 1.0 / length, given.knots)
        self.reset(1)

    def reset(self, count: int) -> None:
        """Resets plans and estimates at the start of the episodes of ``count`` fish."""
        self._plans = np.tile(np.array(self.settings.start), (count, self.settings.knots, 1))
        self._unknown = np.zeros((len(UNKNOWNS), count))
        self._expected: FloatArray | None = None
        self._rng = np.random.default_rng(self.settings.seed)

    def act(self, observations: npt.ArrayLike) -> Float32Array:
        """Returns actions (N, 5) for observations (N, 33)."""
        seen = Seen.of(observations)
        self._learn(seen)
        candidates = self._candidates()
        actions = np.einsum("hk,nckj->hncj", self._to_steps, candidates)
        costs = self._prediction.total(seen, actions, self._unknown)
        total = costs.sum(axis=0) + (self.settings.final - 1.0) * costs[-1]
        self._plans = np.einsum("nc,nckj->nkj", self._weights(total), candidates)
        chosen = self._plans[:, 0]
        self._expected = self._prediction.watched_after(seen, chosen, self._unknown)
        return np.asarray(chosen, np.float32)

    def _learn(self, seen: Seen) -> None:
        """Corrects the unknowns by the error of the last prediction."""
        if self._expected is None:
            return
        wrong = np.stack([seen.pitch_rate, seen.heave, seen.yaw_rate]) - self._expected
        step = np.array(self.settings.learning)[:, None] * wrong / SENSITIVITY[:, None]
        limits = UNKNOWN_LIMITS[:, None]
        self._unknown = np.clip(self._unknown + step, -limits, limits)

    def _candidates(self) -> FloatArray:
        """Returns plans (N, K, knots, 5) around the last one, shifted by a control period."""
        given = self.settings
        shape = (given.candidates, given.knots, len(given.spread))
        offsets = self._rng.standard_normal(shape) * np.array(given.spread)
        offsets[0] = 0.0
        plans = self._shift @ self._plans
        return np.asarray(np.clip(plans[:, None] + offsets, -1.0, 1.0))

    def _weights(self, cost: FloatArray) -> FloatArray:
        """Returns the weights (N, K) of the candidates in the new plans."""
        best = cost.min(axis=1, keepdims=True)
        scale = self.settings.temperature * cost.std(axis=1, keepdims=True) + 1e-9
        weights = np.exp((best - cost) / scale)
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _hat(at: FloatArray, knots: int) -> FloatArray:
    """Returns a matrix (len(at), knots) for linear interpolation; beyond the knots, the last."""
    inside = np.clip(at, 0.0, knots - 1.0)
    return np.maximum(0.0, 1.0 - np.abs(inside[:, None] - np.arange(knots)))
