"""Tail asymmetry: the amplitude is larger on one side.

The angle is exact. The tail's rate jumps where the stroke changes sign, and steps are parted there.
The acceleration, which acts only on the inertia of the water, contains the whole jump as a wider
pulse.
"""

from __future__ import annotations

import math

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import TWO_PI
from fish_env.model.trigonometry import rounded, sincos

PULSE_AREA = 0.6169605345437128  # integral of cos^16 over half a turn, pi C(16, 8) / 2^16


SAME = 1e-4 / math.pi
"""Half turns. A phase this close below a multiple of pi has reached it."""


@kernel
def stretched(tail, inputs, sine, cosine, side, e):
    """The tail with ratio A1 side sin(phi_t) added, and its derivatives; side is that of the sine.

    The acceleration, which is even in the side, holds the jump as a pulse.
    """
    amplitude, amplitude_rate = inputs.tail_amplitude, inputs.tail_amplitude_rate
    frequency, frequency_rate = inputs.tail_frequency, inputs.tail_frequency_rate
    omega = TWO_PI * frequency
    swing = omega * amplitude
    rate = side * (swing * cosine + amplitude_rate * sine)
    pulse = cosine * cosine
    pulse = pulse * pulse
    pulse = pulse * pulse
    pulse = pulse * pulse
    bend = (2.0 / PULSE_AREA) * pulse - abs(sine)
    slewing = 2.0 * omega * amplitude_rate + TWO_PI * frequency_rate * amplitude
    return Tail(
        tail.angle + e.ratio * (amplitude * (side * sine)),
        tail.rate + e.ratio * rate,
        tail.acceleration + e.ratio * (omega * swing * bend + side * (slewing * cosine)),
    )


@kernel
def stretch_half_strokes(tail, inputs, phase, time, fish, e, memory, since):
    """Adds ratio A1 |sin(phi_t)| to the angle, and its derivatives."""
    (side,) = memory
    sine, cosine = sincos(phase)
    return stretched(tail, inputs, sine, cosine, side, e), (side,)


@kernel
def turns(e):
    """Whether it is on."""
    return e.ratio != 0.0


@kernel
def corner(tail, phase, later, later_phase, e, memory, length):
    """When the stroke changes its sign; it is positive until then (1) or negative (-1)."""
    half_turns = rounded(phase / math.pi + SAME - 0.5)
    side = 1.0 if half_turns - 2.0 * rounded(0.5 * half_turns - 0.25) == 0.0 else -1.0
    turned = later_phase - phase
    left = (half_turns + 1.0) * math.pi - phase
    share = left / (turned if turned > 0.0 else 1.0)
    return length * share if turned > left else math.inf, (side,)


@kernel
def start_anywhere(inputs, tail, fish, e):
    """The tail is on one side, or goes there."""
    stroke = tail.angle - inputs.tail_offset
    return (1.0 if (stroke if stroke != 0.0 else tail.rate) > 0.0 else -1.0,)


EFFECT = Effect(
    name="tail_asymmetry",
    section="actuation",
    summary="One half stroke is larger: the fish turns, more so at higher tail frequency.",
    equation="A1 -> A1 (1 + ratio) while sin(phi_t) > 0, A1 (1 - ratio) while sin(phi_t) < 0",
    source="A linkage or a servo that is stronger to one side",
    parameters=(
        EffectParameter(
            "ratio", "-", 0.0, -1.0, 1.0, (-0.2, 0.2), "added share of A1, sin(phi_t) > 0"
        ),
    ),
    hooks={"tail": stretch_half_strokes},
    memory={"tail": ("side",)},
    initial_states=start_anywhere,
    turns=turns,
    corner=corner,
    order=1,
    confusable_with=(
        "com_offset",
        "tail_bias",
    ),
)
