"""What is random in a measured run: sensors, a disturbance, and the tail's phase."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.identification.variation import EVERY

RELAXED_PHASE_SD = 0.3
"""Random walk of the phase (rad/s^0.5) that stays in step with a beat that is a tenth off."""
LARGEST_TURN = 0.3
"""By which one sample may correct the tail's phase (rad). What a phase does is a sine: over this
much it is off its tangent by 5 %, and beyond it a correction soon points the wrong way."""

DISTURBANCE = ("force_sd", "moment_sd", "correlation_s")
"""Names of the numbers of the disturbance."""
UNEVEN_PHASE_SD = 0.03
"""Random walk of the tail's phase (rad/s^0.5) that a fit begins with where runs beat differently:
no such beat is constant to the last. Its size is then estimated with the disturbance, up to
this."""


@dataclass(frozen=True)
class NoiseModel:
    """What is random in a measured run.

    Attributes:
        sensor_sd: (C,) white noise of each channel.
        force_sd: stationary standard deviation of the disturbance force, each axis (N).
        moment_sd: of the disturbance moment, each axis (N m).
        correlation_s: correlation time of the disturbance (s).
        phase_sd: random walk of the tail's phase about its command (rad/s^0.5).
        jitter_sd: how early or late samples are, all channels of one alike (s).
        spread: (K,) standard deviation over runs of what differs between them.
    """

    sensor_sd: FloatArray
    force_sd: float
    moment_sd: float
    correlation_s: float
    phase_sd: float = 0.0
    jitter_sd: float = 0.0
    spread: FloatArray = field(default_factory=lambda: np.zeros(len(EVERY)))

    def is_close(self, other: NoiseModel, share: float) -> bool:
        """Whether the disturbance of another noise model differs by less than a share of this."""
        pairs = [(getattr(self, name), getattr(other, name)) for name in DISTURBANCE]
        return all(abs(np.log(b / a)) < share for a, b in pairs)

    def sensors_are_close(self, other: NoiseModel, share: float) -> bool:
        """Whether the noise of another's sensors differs by less than a share of this one's."""
        return bool(np.all(np.abs(np.log(other.sensor_sd / self.sensor_sd)) < share))

    def towards(self, other: NoiseModel, share: float) -> NoiseModel:
        """Part of the way to another noise model, in logarithms of the disturbance and sensors.

        Args:
            other: the noise model.
            share: of the way; jitter and phase are the other's.
        """

        def between(a: Any, b: Any) -> Any:
            return a ** (1.0 - share) * b**share

        return replace(
            other,
            sensor_sd=between(self.sensor_sd, other.sensor_sd),
            **{n: between(getattr(self, n), getattr(other, n)) for n in DISTURBANCE},
        )

    @property
    def phase_reach(self) -> float:
        """Largest turn of the tail's phase by one sample (rad).

        Under relaxed noise the phase may be off by any amount, and has to be found.
        """
        return np.inf if self.phase_sd >= RELAXED_PHASE_SD else LARGEST_TURN

    @property
    def wrench_variance(self) -> FloatArray:
        """(6,) variances of force and moment."""
        return np.repeat([self.force_sd**2, self.moment_sd**2], 3)
