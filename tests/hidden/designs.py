"""The same experiment again: other noise, and exactly this effect, or none.

A power curve needs what the suite's cases do not give: one fish and one set of schedules, at a
known noise, swum many times with an effect of a size that was chosen beforehand.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.hidden.cases import NOMINAL
from tests.hidden.disturbances import MOMENT_PER_FORCE
from tests.hidden.fishes import draw_fish
from tests.hidden.plans import PLANS, Plan
from tests.hidden.recording import Experiment, plausible_run, write
from tests.hidden.truth import Truth


@dataclass(frozen=True)
class Noise:
    """What blurs the measurements.

    Attributes:
        sensors: one-sigma noise of the sensors, in units of the plan's.
        force: rms force of the random push on each axis, N.
        memory: its correlation time, s.
    """

    sensors: float = 1.0
    force: float = 0.003
    memory: float = 0.7

    @property
    def moment(self) -> float:
        """Rms moment of the push, N m."""
        return MOMENT_PER_FORCE * self.force


def swim_design(
    design: int,
    repeat: int,
    folder: Path,
    effects: Mapping[str, Mapping[str, float]],
    noise: Noise | None = None,
    plan: Plan = PLANS["rich"],
) -> Truth:
    """Writes the dataset of a design, with effects of exactly these parameters.

    Args:
        design: number of the fish and of its schedules.
        repeat: number of the noise; two repeats share nothing of it but its size.
        folder: new folder for the dataset.
        effects: parameters by effect.
        noise: its size.
        plan: runs, channels and rate.
    """
    noise = noise or Noise()
    key = zlib.crc32(b"design")
    fish_rng, schedules = np.random.default_rng([key, design]).spawn(2)
    push, sensors = np.random.default_rng([key, design, repeat]).spawn(2)
    nominal = NOMINAL[design % 2]
    fish = draw_fish(nominal, fish_rng)
    truth = Truth(
        "design",
        design,
        nominal,
        effects={name: dict(values) for name, values in effects.items()},
        coefficients=fish.values(),
        disturbance={
            "colour": "ou",
            "force": noise.force,
            "time_constant": noise.memory,
            "inertial": False,
        },
        noise={name: sd * noise.sensors for name, sd in plan.noise.items()},
    )
    case = Experiment(truth, fish, plan, [schedules, push, sensors])
    runs = [plausible_run(case, index) for index in range(plan.runs)]
    return write(case, (truth, runs), folder)
