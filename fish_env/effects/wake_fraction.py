"""Wake fraction: the tail swims in the wake of the body, where the water is slower.

It acts on lift and drag of the tail. The reactive force (``tail_reactive``) keeps the speed of the
body: its theory accounts for the water along the whole tail, not for the flow at one point.
"""

from __future__ import annotations

from fish_env.model.body import with_surge
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel


@kernel
def slow_inflow(motion, fish, e):
    """V_x -> (1 - fraction) V_x in the tail's own flow."""
    return with_surge(motion, (1.0 - e.fraction) * motion.u)


EFFECT = Effect(
    name="wake_fraction",
    section="hydrodynamics",
    summary="The tail meets slower water than the body: more thrust at speed than expected.",
    equation="v_t is computed with (1 - fraction) V_x",
    source="Carlton, Marine Propellers and Propulsion, section 5: Taylor's wake fraction",
    parameters=(
        EffectParameter(
            "fraction", "-", 0.0, -0.5, 0.9, (0.05, 0.4), "share of V_x lost at the tail"
        ),
    ),
    hooks={"tail_inflow": slow_inflow},
    confusable_with=(
        "linear_drag",
        "tail_gain",
        "tail_stall",
    ),
)
