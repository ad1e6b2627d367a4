"""What a privileged critic sees: the true state, the parameters of the fish, the goal's future.

A critic is used in training alone, so it may know what no sensor measures (Pinto et al.,
"Asymmetric Actor Critic for Image-Based Robot Learning", arXiv:1710.06542). The policy gets none of
it. Values that are known better make advantages less noisy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.batch import FishBatch
from fish_env.envs.layout import GOAL, OBSERVATION, REFERENCE
from robofish_agents.training.teacher import Float32Array, true_observations

AHEAD_S = (0.5, 1.0, 2.0, 4.0)
"""Times from now (s) at which the critic knows the goals."""
SCALE = {"depth": 0.3, "heading": 0.5}
"""Change of a goal (m, rad) that is scaled to one."""
FLOW = ("effects.current.north", "effects.current.east")
FLOW_SCALE = 0.02
"""Speed of the water (m/s) that is scaled to one."""


class Sight:
    """Privileged observations of several batches side by side.

    The true state, the goals as far as they can be foreseen, the flow, the parameters, and then
    the goals as they will be.

    Args:
        batches: the fish; each batch may draw other parameters.
    """

    def __init__(self, batches: Sequence[FishBatch]) -> None:
        self._batches = tuple(batches)
        drawn = [path for batch in self._batches for path in batch.drawn]
        self.paths = tuple(dict.fromkeys(drawn))
        """Parameters that any of the batches draws."""
        known = len(OBSERVATION) + 2 * len(AHEAD_S) + len(FLOW) + len(self.paths)
        self.width = known + 2 * len(AHEAD_S)
        """Numbers of a privileged observation."""
        self.present = known
        """The first of them know nothing of steps and ramps to come: what a teacher may see."""

    def see(self, observations: Float32Array) -> Float32Array:
        """Returns privileged observations (N, m), float32.

        Args:
            observations: (N, 33) of the environment; they give the goals, commands and actuators.
        """
        ends = np.cumsum([batch.count for batch in self._batches])[:-1]
        rows = zip(np.split(observations, ends), self._batches, strict=True)
        return np.concatenate([self._of(*row) for row in rows]).astype(np.float32)

    def _of(self, observations: Float32Array, batch: FishBatch) -> FloatArray:
        true = true_observations(observations, batch)
        own = np.reshape([drawn(batch, path) for path in self.paths], (-1, batch.count))
        now = (true.T, *foreseeable(batch), flow(batch), own)
        return np.concatenate([*now, *future(batch)]).T


def foreseeable(batch: FishBatch) -> list[FloatArray]:
    """As :func:`future`, if no step and no ramp begins or ends: what the past of a goal tells."""
    goal, now = batch.goal, batch.time
    changes = []
    for name in ("depth", "heading"):
        given = {field: goal[GOAL.index(f"{name}_{field}")] for field in REFERENCE}
        ramping = (now >= given["ramp_start"]) & (now < given["ramp_end"])
        rate = np.where(ramping, given["ramp_rate"], 0.0)
        omega = 2.0 * np.pi * given["sine_frequency"]
        rows = [
            rate * ahead
            + given["sine_amplitude"]
            * (
                np.sin(omega * (now + ahead) + given["sine_phase"])
                - np.sin(omega * now + given["sine_phase"])
            )
            for ahead in AHEAD_S
        ]
        changes.append(np.stack(rows) / SCALE[name])
    return changes


def future(batch: FishBatch) -> list[FloatArray]:
    """Changes (times, N) of the goals of depth and heading from now on, scaled."""
    goal = batch.goal
    return [
        np.stack(
            [
                (reference(goal, name, batch.time + ahead) - reference(goal, name, batch.time))
                / SCALE[name]
                for ahead in AHEAD_S
            ]
        )
        for name in ("depth", "heading")
    ]


def reference(goal: FloatArray, name: str, time: FloatArray) -> FloatArray:
    """Value (N,) of a goal's signal, see :data:`fish_env.envs.layout.REFERENCE`.

    Args:
        goal: (len(GOAL), N) goals of the fish.
        name: ``depth`` or ``heading``.
        time: (N,) time since the start of the episode (s).
    """
    given = {field: goal[GOAL.index(f"{name}_{field}")] for field in REFERENCE}
    start, end = given["ramp_start"], given["ramp_end"]
    phase = 2.0 * np.pi * given["sine_frequency"] * time + given["sine_phase"]
    return np.asarray(
        given["base"]
        + given["step"] * (time >= given["step_time"])
        + given["ramp_rate"] * (np.clip(time, start, np.maximum(start, end)) - start)
        + given["sine_amplitude"] * np.sin(phase)
    )


def flow(batch: FishBatch) -> FloatArray:
    """Speed (2, N) of the water along and across the fish, scaled; zero without a drawn flow."""
    if not set(FLOW) <= set(batch.drawn):
        return np.zeros((2, batch.count))
    north, east = (batch.drawn[path] / FLOW_SCALE for path in FLOW)
    qw, qx, qy, qz = batch.state[3:7]
    along = np.stack([1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy + qw * qz)])
    cosine, sine = along / np.hypot(*along)
    return np.stack([cosine * north + sine * east, cosine * east - sine * north])


def drawn(batch: FishBatch, path: str) -> FloatArray:
    """A drawn parameter (N,), scaled by its distribution; zeros where a batch does not draw it."""
    random = batch.options.random
    if random is None or path not in batch.drawn:
        return np.zeros(batch.count)
    row = random.paths.index(path)
    first, second = random.first[row], random.second[row]
    if random.uniform[row]:
        centre, scale = (first + second) / 2.0, (second - first) / 2.0
    else:
        centre, scale = first, second
    return np.asarray((batch.drawn[path] - centre) / max(scale, 1e-12))
