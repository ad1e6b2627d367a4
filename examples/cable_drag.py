"""An effect of one's own: a cable that trails from the stern and drags."""

import math

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector
from fish_env.model.tail import wrench_at


@kernel
def drag_at_the_stern(motion, tail, inputs, centre, fish, e):
    """Force against the water's flow at (x, 0, 0), and its moment about O_b."""
    v = motion.v + motion.r * e.x
    w = motion.w - motion.q * e.x
    factor = -e.coefficient * math.sqrt(motion.u * motion.u + v * v + w * w)
    return wrench_at(e.x, 0.0, 0.0, Vector(factor * motion.u, factor * v, factor * w))


EFFECT = Effect(
    name="cable_drag",
    section="hydrodynamics",
    summary="The fish pulls a cable along: slower, and steadier in yaw.",
    equation="F = -coefficient |v| v at (x, 0, 0), v the velocity of that point through the water",
    source="a bluff body's drag",
    parameters=(
        EffectParameter("coefficient", "N s^2/m^2", 0.0, 0.0, 100.0, (0.1, 2.0), "1/2 rho S C_D"),
        EffectParameter("x", "m", -0.14, -1.0, 1.0, (-0.2, 0.0), "where the cable leaves the hull"),
    ),
    hooks={"wrench": drag_at_the_stern},
)
