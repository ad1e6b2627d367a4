"""Cross-flow drag: drag of the flow across the body."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def eddy_drag(motion, tail, inputs, centre, fish, e):
    """-sway v |v| and -heave w |w| at O_b, with the velocity relative to the water."""
    return Wrench(
        0.0,
        -e.sway * motion.v * abs(motion.v),
        -e.heave * motion.w * abs(motion.w),
        0.0,
        0.0,
        0.0,
    )


def _coefficient(name: str) -> EffectParameter:
    return EffectParameter(
        name, "N s^2/m^2", 0.0, 0.0, 200.0, (1.0, 15.0), f"1/2 rho S C_D in {name}"
    )


EFFECT = Effect(
    name="cross_flow_drag",
    section="hydrodynamics",
    summary="More drag on sideways and vertical motion, at every forward speed.",
    equation="F_y = -sway v |v|, F_z = -heave w |w|",
    source="Hoerner, Fluid-Dynamic Drag, section 3: the cross-flow principle",
    parameters=(_coefficient("sway"), _coefficient("heave")),
    hooks={"wrench": eddy_drag},
    confusable_with=(
        "added_mass",
        "linear_drag",
        "offset_drag",
        "quadratic_damping",
    ),
)
