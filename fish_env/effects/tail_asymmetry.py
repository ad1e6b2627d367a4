"""Tail asymmetry: the tail swings further to one side."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import TWO_PI
from fish_env.model.trigonometry import sincos

KINK_AREA = 0.6169605345437128  # integral of cos^16 over half a turn, pi C(16, 8) / 2^16


@kernel
def stretch_half_strokes(tail, inputs, phase, time, fish, e):
    """A1 (1 + ratio) where sin(phi_t) > 0, A1 (1 - ratio) elsewhere: adds ratio A1 |sin(phi_t)|.

    The rate jumps by 2 ratio A1 d(phi_t)/dt where the half strokes meet. The acceleration holds
    that jump as a pulse cos^16(phi_t) around it, so that it still integrates to the rate.
    """
    sine, cosine = sincos(phase)
    omega = TWO_PI * inputs.tail_frequency
    amplitude, amplitude_rate = inputs.tail_amplitude, inputs.tail_amplitude_rate
    side = e.ratio if sine > 0.0 else -e.ratio
    pulse = cosine * cosine
    pulse = pulse * pulse
    pulse = pulse * pulse
    pulse = pulse * pulse
    kinks = e.ratio * ((2.0 / KINK_AREA) * (omega * omega) * amplitude * pulse)
    return Tail(
        tail.angle + side * (amplitude * sine),
        tail.rate + side * (omega * amplitude * cosine + amplitude_rate * sine),
        tail.acceleration
        + side * (2.0 * omega * amplitude_rate * cosine - omega * omega * amplitude * sine)
        + kinks,
    )


EFFECT = Effect(
    name="tail_asymmetry",
    section="actuation",
    summary="One half stroke is larger: the fish turns, more so the faster it beats.",
    equation="A1 -> A1 (1 + ratio) while sin(phi_t) > 0, A1 (1 - ratio) while sin(phi_t) < 0",
    source="A linkage or a servo that is stronger to one side",
    parameters=(
        EffectParameter(
            "ratio", "-", 0.0, -1.0, 1.0, (-0.2, 0.2), "extra swing of the positive half stroke"
        ),
    ),
    hooks={"tail": stretch_half_strokes},
    order=1,
    confusable_with=("tail_bias", "com_offset"),
)
