"""What is known of the tail's beat before any force model is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fish_env.identification.policy import IDENTIFICATION
from fish_env.inference.hypotheses import EffectParameterId, effect_names
from fish_env.inference.vehicle import Drive
from fish_env.model.effect import Effect

SCALE = EffectParameterId("frequency_scale", "scale")
RATE = EffectParameterId("battery_sag", "rate")
LATE = effect_names(
    "servo_lag",
    "servo_delay",
    "servo_rate_limit",
    "servo_torque_limit",
    "tail_flexibility",
    "wake_memory",
)
"""Effects that make the tail or its force late."""
LATE_SENSORS = effect_names("sensor_delay", "imu_lowpass")
"""Effects that make what is measured late."""
BESIDE = (-6e-3, -3e-3, 0.0, 3e-3, 6e-3)
"""Departures from the measured beat that a fit begins from: less than a third of a cycle in a run
of a minute."""


@dataclass(frozen=True)
class TailDrive(Drive):
    """How the tail departs from its commands in all runs.

    Attributes:
        measured: effect parameter -> about its value; empty where no beat is clear.
    """

    measured: Mapping[EffectParameterId, float] = field(default_factory=dict)

    @property
    def scale(self) -> float:
        """Beat over the commanded frequency, beside what else was measured."""
        return self.measured.get(SCALE, 1.0)

    def at(self, scale: float) -> TailDrive:
        """The same with another beat over the commanded frequency."""
        return tail_drive({**self.measured, SCALE: scale}, self.certain, self.uneven)

    def of_uneven_runs(self, scale: float, rate: float) -> TailDrive:
        """The same where single runs differ, with what they share of their beats and sags.

        Args:
            scale: beat over the commanded frequency at the start; 1 for what is ordinary.
            rate: share of it lost each second (1/s); 0 likewise.
        """
        others = {id: value for id, value in self.measured.items() if id != RATE}
        sag = {RATE: rate} if rate else {}
        return tail_drive({**others, SCALE: scale, **sag}, self.certain, uneven=True)

    def beside(self, effect: Effect) -> tuple[dict[str, float], ...]:
        """Sizes of an effect that scales the beat, around what was measured.

        For runs whose phase at the start is unknown: of a comb of sizes each would have its own.

        Args:
            effect: the effect; none of one that scales no beat.
        """
        scales = [p.name for p in effect.switching if p.neutral == 1.0 and p.unit == "-"]
        if not effect.drifts_in_phase or len(scales) != 1:
            return ()
        return tuple({scales[0]: self.scale + off} for off in BESIDE)


def tail_drive(
    measured: Mapping[EffectParameterId, float], certain: bool = False, uneven: bool = False
) -> TailDrive:
    """What is known of the beat, and which effects put a model in step with it.

    None do where all beats are off by one ratio only: several effects do that, and a comparison of
    all of them tells which. Where single runs differ nothing can be compared before they are in
    step, so that the ratio itself is where a fit begins.

    Args:
        measured: effect parameter -> about its value.
        certain: whether chance is ruled out for what was measured.
        uneven: whether single runs differ; what is ordinary is then in the runs' own beats.
    """
    found = dict(measured)
    least = 0.0 if uneven else IDENTIFICATION.ordinary_beat_error
    ordinary = SCALE in found and abs(found[SCALE] - 1.0) <= least
    if ordinary:
        found.pop(SCALE)
    in_step = found if uneven or found.keys() - {SCALE} else {}
    return TailDrive(
        in_step,
        known=bool(in_step) or ordinary,
        certain=bool(in_step) and certain,
        uneven=uneven,
        measured=measured,
    )
