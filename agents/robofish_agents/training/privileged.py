"""What a privileged critic sees: the true state, the parameters of the fish, the goal's future.

A critic is used in training alone, so it may know what no sensor measures (Pinto et al.,
"Asymmetric Actor Critic for Image-Based Robot Learning", arXiv:1710.06542). The policy gets none of
it. Values that are known better make advantages less noisy.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np

from fish_env.envs.layout import GOAL, OBSERVATION, REFERENCE
from robofish_agents.training.teacher import TrueFish, true_observations

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
        xp: ``numpy``, or ``torch`` if their arrays are tensors.
    """

    def __init__(self, batches: Sequence[TrueFish], xp: ModuleType = np) -> None:
        self._batches, self._xp = tuple(batches), xp
        drawn = [path for batch in self._batches for path in batch.drawn]
        self.paths = tuple(dict.fromkeys(drawn))
        """Parameters that any of the batches draws."""
        known = len(OBSERVATION) + 2 * len(AHEAD_S) + len(FLOW) + len(self.paths)
        self.width = known + 2 * len(AHEAD_S)
        """Numbers of a privileged observation."""
        self.present = known
        """The first of them know nothing of steps and ramps to come: what a teacher may see."""

    def see(self, observations: Any) -> Any:
        """Returns privileged observations (N, m), float32.

        Args:
            observations: (N, 33) of the environment; they give the goals, commands and actuators.
        """
        ends = np.cumsum([0, *(batch.count for batch in self._batches)]).tolist()
        rows = [observations[first:last] for first, last in pairwise(ends)]
        seen = [self._of(*row) for row in zip(rows, self._batches, strict=True)]
        return self._xp.asarray(self._xp.concatenate(seen), dtype=self._xp.float32)

    def _of(self, observations: Any, batch: TrueFish) -> Any:
        xp = self._xp
        true = true_observations(observations, batch, xp)
        own = [drawn(batch, path, xp)[None] for path in self.paths]
        now = (true.T, *foreseeable(batch, xp), flow(batch, xp), *own)
        return xp.concatenate([*now, *future(batch, xp)]).T


def foreseeable(batch: TrueFish, xp: ModuleType = np) -> list[Any]:
    """As :func:`future`, if no step and no ramp begins or ends: what the past of a goal tells."""
    goal, now = batch.goal, batch.time
    changes = []
    for name in ("depth", "heading"):
        given = {field: goal[GOAL.index(f"{name}_{field}")] for field in REFERENCE}
        ramping = (now >= given["ramp_start"]) & (now < given["ramp_end"])
        rate = given["ramp_rate"] * ramping
        omega = 2.0 * np.pi * given["sine_frequency"]
        rows = [
            rate * ahead
            + given["sine_amplitude"]
            * (
                xp.sin(omega * (now + ahead) + given["sine_phase"])
                - xp.sin(omega * now + given["sine_phase"])
            )
            for ahead in AHEAD_S
        ]
        changes.append(xp.stack(rows) / SCALE[name])
    return changes


def future(batch: TrueFish, xp: ModuleType = np) -> list[Any]:
    """Changes (times, N) of the goals of depth and heading from now on, scaled."""
    goal, now = batch.goal, batch.time
    found = []
    for name in ("depth", "heading"):
        present = reference(goal, name, now, xp)
        rows = [reference(goal, name, now + ahead, xp) - present for ahead in AHEAD_S]
        found.append(xp.stack(rows) / SCALE[name])
    return found


def reference(goal: Any, name: str, time: Any, xp: ModuleType = np) -> Any:
    """Value (N,) of a goal's signal, see :data:`fish_env.envs.layout.REFERENCE`.

    Args:
        goal: (len(GOAL), N) goals of the fish.
        name: ``depth`` or ``heading``.
        time: (N,) time since the start of the episode (s).
        xp: ``numpy``, or ``torch`` if these are tensors.
    """
    given = {field: goal[GOAL.index(f"{name}_{field}")] for field in REFERENCE}
    start, end = given["ramp_start"], given["ramp_end"]
    phase = 2.0 * np.pi * given["sine_frequency"] * time + given["sine_phase"]
    return (
        given["base"]
        + given["step"] * (time >= given["step_time"])
        + given["ramp_rate"] * (xp.clip(time, start, xp.maximum(start, end)) - start)
        + given["sine_amplitude"] * xp.sin(phase)
    )


def flow(batch: TrueFish, xp: ModuleType = np) -> Any:
    """Speed (2, N) of the water along and across the fish, scaled; zero without a drawn flow."""
    if not set(FLOW) <= set(batch.drawn):
        return xp.stack([xp.zeros_like(batch.time)] * 2)
    north, east = (batch.drawn[path] / FLOW_SCALE for path in FLOW)
    qw, qx, qy, qz = batch.state[3:7]
    along, across = 1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy + qw * qz)
    length = xp.hypot(along, across)
    cosine, sine = along / length, across / length
    return xp.stack([cosine * north + sine * east, cosine * east - sine * north])


def drawn(batch: TrueFish, path: str, xp: ModuleType = np) -> Any:
    """A drawn parameter (N,), scaled by its distribution; zeros where a batch does not draw it."""
    random = batch.options.random
    if random is None or path not in batch.drawn:
        return xp.zeros_like(batch.time)
    row = random.paths.index(path)
    first, second = float(random.first[row]), float(random.second[row])
    if random.uniform[row]:
        centre, scale = (first + second) / 2.0, (second - first) / 2.0
    else:
        centre, scale = first, second
    return (batch.drawn[path] - centre) / max(scale, 1e-12)
