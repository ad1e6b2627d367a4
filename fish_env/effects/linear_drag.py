"""Linear drag: skin friction of slow flow, proportional to speed."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def viscous_drag(motion, tail, inputs, centre, fish, e):
    """-diag(surge, sway, heave) V_rel at O_b."""
    return Wrench(-e.surge * motion.u, -e.sway * motion.v, -e.heave * motion.w, 0.0, 0.0, 0.0)


def _coefficient(name: str, plausible: tuple[float, float]) -> EffectParameter:
    return EffectParameter(name, "N s/m", 0.0, 0.0, 50.0, plausible, f"linear drag in {name}")


EFFECT = Effect(
    name="linear_drag",
    section="hydrodynamics",
    summary="Drag in proportion to speed: the fish glides a shorter distance.",
    equation="F = -diag(surge, sway, heave) V_rel",
    source="Fossen, Handbook of Marine Craft, section 6.4: linear viscous damping",
    parameters=(
        _coefficient("surge", (0.02, 0.5)),
        _coefficient("sway", (0.05, 2.0)),
        _coefficient("heave", (0.05, 2.0)),
    ),
    hooks={"wrench": viscous_drag},
    confusable_with=(
        "cross_flow_drag",
        "current",
        "floor_effect",
        "offset_drag",
        "surface_drag",
        "tail_gain",
        "tether",
        "wake_fraction",
        "wall_effect",
    ),
)
