"""Surface piercing: a hull that is partly out of the water displaces less.

The hull is taken for a spheroid about its length, and the surface for flat. What is out of the
water is then a cap, whose volume and centroid are known in closed form at every attitude. Lift,
drag and inertia of the water stay those of a submerged hull.
"""

from __future__ import annotations

import math
from math import inf

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench

GRAVITY = 9.81
"""m/s^2, for the time scale of heave."""


@kernel
def lose_buoyancy(motion, tail, inputs, centre, fish, e):
    """The weight of the water that the cap displaced, and the moment of what is still displaced.

    With n the downward vertical (body), H = height sqrt(1 + (slenderness^2 - 1) n_x^2) is half
    the vertical extent of the hull, and out = (H - z) / 2H the share of it above the surface. A
    stretched sphere loses the share s = out^2 (3 - 2 out) of its volume, and the rest has its
    centroid at D / H A^2 n, D = 3 out^2 / (1 + 2 out), A = height diag(slenderness, 1, 1).
    """
    on = e.height > 0.0
    x, y, z = motion.attitude.zx, motion.attitude.zy, motion.attitude.zz
    stretch = e.slenderness * e.slenderness - 1.0
    half = (e.height if on else 1.0) * math.sqrt(1.0 + stretch * (x * x))
    out = min(max(0.5 - 0.5 * motion.z / half, 0.0), 1.0)
    square = out * out
    weight = centre.buoyancy_mass * fish.gravity if on else 0.0
    lost = weight * (square * (3.0 - 2.0 * out))
    deep = 3.0 * square / (half * (1.0 + 2.0 * out))
    turning = (weight - lost) * deep * (e.height * e.height * stretch) * x
    return Wrench(lost * x, lost * y, lost * z, 0.0, turning * z, -turning * y)


def fastest(values):
    """Inverse of the largest angular frequency of heave: w^2 = 3/4 gravity / height."""
    return math.sqrt(values["height"] / (0.75 * GRAVITY)) if values["height"] > 0.0 else inf


EFFECT = Effect(
    name="surface_piercing",
    section="surroundings",
    summary="At the surface a part of the hull is out of the water: the fish loses buoyancy.",
    equation=(
        "F = s m_b g down, s = out^2 (3 - 2 out), out = (H - z) / 2H within [0, 1], "
        "H = height sqrt(1 + (slenderness^2 - 1) n_x^2), n = R^T down, "
        "M = (1 - s) m_b g D/H height^2 (slenderness^2 - 1) (0, n_x n_z, -n_x n_y), "
        "D = 3 out^2 / (1 + 2 out)"
    ),
    source=(
        "Archimedes' principle for a spheroid that floats: volume and centroid of a spherical cap, "
        "stretched; Newman, Marine Hydrodynamics, chapter 6"
    ),
    parameters=(
        EffectParameter(
            "height", "m", 0.0, 0.0, 0.5, (0.02, 0.08), "half the height of the level hull"
        ),
        EffectParameter(
            "slenderness",
            "-",
            1.0,
            0.2,
            10.0,
            (1.0, 4.0),
            "length of the hull over its height",
            shapes=True,
            probed=False,
        ),
    ),
    hooks={"wrench": lose_buoyancy},
    time_scale=fastest,
    confusable_with=(
        "buoyancy_offset",
        "surface_drag",
    ),
)
