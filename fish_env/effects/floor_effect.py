"""Floor effect: the body has more drag near the floor.

The decay is empirical. The floor does not stop the fish, pull it, or change the forces of the tail.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.trigonometry import exponential


@kernel
def raise_drag(factor, motion, fish, e):
    """Factor of the drag + gain exp(-away/range); below the floor as at it."""
    away = max(e.depth - motion.z, 0.0)
    return factor + e.gain * exponential(-away / e.range)


EFFECT = Effect(
    name="floor_effect",
    section="surroundings",
    summary="The fish is slower near the floor, where its drag is larger.",
    equation=(
        "C_D of both body planes x (1 + gain exp(-away/range)), away = depth - z, at least 0; "
        "shares of surface, floor and wall add"
    ),
    source=(
        "Mitra, Panda and Warrior (2019), arXiv:1904.13305: drag of an underwater vehicle over a "
        "sea bed. The decay is empirical"
    ),
    parameters=(
        EffectParameter("gain", "-", 0.0, 0.0, 20.0, (0.2, 3.0), "extra drag at the floor"),
        EffectParameter(
            "depth", "m", 1.5, 0.05, 100.0, (0.5, 3.0), "of the floor", shapes=True
        ),
        EffectParameter(
            "range", "m", 0.2, 0.005, 5.0, (0.05, 0.5), "distance of decay by 1/e", shapes=True,
            probed=False,
        ),
    ),
    hooks={"body_drag": raise_drag},
    order=1,
    confusable_with=(
        "linear_drag",
        "surface_drag",
        "wall_effect",
    ),
)  # fmt: skip
