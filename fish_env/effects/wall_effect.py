"""Wall effect: the body has more drag near an upright wall.

The decay is empirical. The wall does not stop the fish, pull it, or change the forces of the tail.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import exponential, sincos


@kernel
def raise_drag(factor, motion, fish, e):
    """Factor of the drag + gain exp(-away/range); behind the wall as at it."""
    east, north = sincos(e.heading)
    away = max(e.distance - (north * motion.x + east * motion.y), 0.0)
    return factor + e.gain * exponential(-away / e.range)


EFFECT = Effect(
    name="wall_effect",
    section="surroundings",
    summary="The fish is slower near a wall, where its drag is larger.",
    equation=(
        "C_D of both body planes x (1 + gain exp(-away/range)), "
        "away = distance - x cos heading - y sin heading, at least 0; "
        "shares of surface, floor and wall add"
    ),
    source=(
        "Blockage: a body near a wall meets faster water; Barlow, Rae and Pope, Low-Speed Wind "
        "Tunnel Testing, chapters 9 and 10. The decay is empirical"
    ),
    parameters=(
        EffectParameter("gain", "-", 0.0, 0.0, 20.0, (0.2, 3.0), "extra drag at the wall"),
        EffectParameter(
            "distance", "m", 1.0, -100.0, 100.0, (0.3, 2.0), "of the wall from x = y = 0",
            shapes=True,
        ),
        # Plausible all around, but less than a turn: walls do not add up as oscillations do.
        EffectParameter(
            "heading", "rad", 0.0, -7.0, 7.0, (-3.0, 3.0), "direction of the wall, from north",
            shapes=True,
        ),
        EffectParameter(
            "range", "m", 0.3, 0.005, 5.0, (0.05, 0.5), "distance of decay by 1/e", shapes=True,
            probed=False,
        ),
    ),
    hooks={"body_drag": raise_drag},
    order=1,
    confusable_with=(
        "floor_effect",
        "linear_drag",
        "tether",
    ),
)  # fmt: skip
