"""Side load: with a tail offset, however large, the servo beats more slowly and swings less.

A real fish does so (docs/real-fish.md). Friction of a drive that is loaded on one side only is one
possible reason: Coulomb's law has a size and a sign, and no slope.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.inputs import offset_size, with_tail_command
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import exponential

ONSET = 0.1
"""rad. Offset at which three quarters of the loss are there. The runs that show the effect have no
offsets between 0 and 0.35 rad, so nothing is known of it but that it is small."""


@kernel
def slow_and_shorten(inputs, time, fish, e):
    """A1 -> A1 (1 - swing s) and f1 -> f1 (1 - beat s), s = tanh(|xi1_bar| / 0.1 rad)."""
    size, size_rate = offset_size(inputs)
    share = 1.0 - 2.0 / (1.0 + exponential(2.0 * size / ONSET))
    rate = (1.0 - share * share) / ONSET * size_rate
    swing, beat = 1.0 - e.swing * share, 1.0 - e.beat * share
    return with_tail_command(
        inputs,
        inputs.tail_offset,
        swing * inputs.tail_amplitude,
        beat * inputs.tail_frequency,
        inputs.tail_offset_rate,
        swing * inputs.tail_amplitude_rate - e.swing * rate * inputs.tail_amplitude,
        beat * inputs.tail_frequency_rate - e.beat * rate * inputs.tail_frequency,
    )


EFFECT = Effect(
    name="side_load",
    section="actuation",
    summary="With any tail offset the tail beats more slowly and swings less than without.",
    equation="A1 -> A1 (1 - swing s), f1 -> f1 (1 - beat s), s = tanh(|xi1_bar| / 0.1 rad)",
    source="Smoothed Coulomb friction: Armstrong-Helouvry, Dupont and Canudas de Wit (1994), "
    "Automatica 30, 1083; the beats of a real fish",
    parameters=(
        EffectParameter("swing", "-", 0.0, 0.0, 0.9, (0.05, 0.3), "share of A1 lost"),
        EffectParameter("beat", "-", 0.0, 0.0, 0.9, (0.02, 0.1), "share of f1 lost"),
    ),
    hooks={"inputs": slow_and_shorten},
    order=1,
    drifts_in_phase=True,
    confusable_with=(
        "beat_load",
        "frequency_scale",
        "offset_drag",
        "swing_loss",
        "tail_gain",
    ),
)
