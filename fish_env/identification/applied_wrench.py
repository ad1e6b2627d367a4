"""An external wrench on the fish: the unknown disturbance that the filter estimates as it goes.

Not in the public catalogue: it explains anything, so it can be the cause of nothing.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def applied(motion, tail, inputs, centre, fish, e):
    """Force (N) and moment about O_b (N m), body frame, held constant between samples."""
    return Wrench(e.fx, e.fy, e.fz, e.mx, e.my, e.mz)


EFFECT = Effect(
    name="applied_wrench",
    section="surroundings",
    summary="A force and a moment from outside.",
    equation="F + f, M + m",
    source="d'Alembert",
    parameters=tuple(
        EffectParameter(name, unit, 0.0)
        for name, unit in zip(
            ("fx", "fy", "fz", "mx", "my", "mz"), ("N",) * 3 + ("N m",) * 3, strict=True
        )
    ),
    hooks={"wrench": applied},
    varies=True,
)
