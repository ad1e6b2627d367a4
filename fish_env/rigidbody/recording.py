"""Measured runs of a vehicle, as far as the checks of this package read them.

They know neither the vehicle nor its commands: whoever has both says when the commands change, when
that jerks the body, and when the vehicle is at rest.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field

import numpy as np

from fish_env.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """One measured run.

    Attributes:
        id: its name.
        time_s: (n,) times of the samples, s, increasing.
        channels: values by channel, each (n,), NaN where a sample is missing.
        switches_s: (m,) times at which commands change, s; rates may have a kink there.
        jerks_s: (k,) those at which a part that moves makes rates leap between samples, s.
        jumps_s: (l,) those at which a command jumps, so that rates may leap, s.
        still_s: (j, 2) begin and end of stretches in which nothing drives the vehicle, s.
        from_rest: whether the run is declared to begin level and at rest.
        repeats: equal for runs that repeat each other from rest; None for a run that repeats none.
    """

    id: str
    time_s: FloatArray
    channels: Mapping[str, FloatArray]
    switches_s: FloatArray
    jerks_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    still_s: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    jumps_s: FloatArray = field(default_factory=lambda: np.zeros(0))
    from_rest: bool = False
    repeats: Hashable | None = None


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured runs of one vehicle, all with the same channels.

    Attributes:
        name: of the data set.
        runs: the runs.
        units: SI unit of each channel.
        noise: declared one-sigma noise by channel, SI, where it is known.
    """

    name: str
    runs: tuple[RecordedRun, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the measured channels."""
        return tuple(self.runs[0].channels)
