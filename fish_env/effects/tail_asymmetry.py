"""Tail asymmetry: the tail swings further to one side.

The two half strokes meet with a jump of the tail's rate. Both angle and rate go over from one
to the other within a phase of about KINK, so that a physics step of 10 ms does not miss the jump;
the acceleration, which only the water's inertia sees, holds the whole jump as a wider pulse.
"""

from __future__ import annotations

import math

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import TWO_PI
from fish_env.model.trigonometry import sincos

KINK = 0.03
"""rad of the tail's phase over which one half stroke goes over into the other."""
PULSE_AREA = 0.6169605345437128  # integral of cos^16 over half a turn, pi C(16, 8) / 2^16


@kernel
def stretch_half_strokes(tail, inputs, phase, time, fish, e):
    """Adds ratio A1 |sin(phi_t)|, with |sin| rounded to (sin^2 + KINK^2 / 2) / root.

    The root is sqrt(sin^2 + KINK^2). Alone it would do, but it nears |sin| slowly: the swing would
    be larger throughout, by enough that a fitted ratio is seen to be off.
    """
    sine, cosine = sincos(phase)
    omega = TWO_PI * inputs.tail_frequency
    amplitude, amplitude_rate = inputs.tail_amplitude, inputs.tail_amplitude_rate
    square = sine * sine + KINK * KINK
    root = math.sqrt(square)
    size = (square - 0.5 * KINK * KINK) / root
    slope = sine * (square + 0.5 * KINK * KINK) / (square * root)
    side = 1.0 if sine > 0.0 else -1.0
    pulse = cosine * cosine
    pulse = pulse * pulse
    pulse = pulse * pulse
    pulse = pulse * pulse
    bend = (2.0 / PULSE_AREA) * pulse - side * sine
    swing = omega * amplitude
    slewing = 2.0 * omega * amplitude_rate + TWO_PI * inputs.tail_frequency_rate * amplitude
    return Tail(
        tail.angle + e.ratio * (amplitude * size),
        tail.rate + e.ratio * (swing * (slope * cosine) + amplitude_rate * size),
        tail.acceleration + e.ratio * (omega * swing * bend + side * (slewing * cosine)),
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
    confusable_with=(
        "com_offset",
        "tail_bias",
    ),
)
