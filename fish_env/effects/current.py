"""Current: uniform steady flow."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector


@kernel
def add_current(water, place, time, e):
    """Water velocity (m/s, inertial): every hydrodynamic term sees V_b - R^T current."""
    return Vector(water.x + e.north, water.y + e.east, water.z + e.down)


def _component(name: str) -> EffectParameter:
    return EffectParameter(name, "m/s", 0.0, -2.0, 2.0, (-0.1, 0.1), f"flow towards {name}")


EFFECT = Effect(
    name="current",
    section="surroundings",
    summary="All of the water moves: the path drifts, and the dynamics do not change.",
    equation="V_rel = V_b - R^T [north, east, down]",
    source="Fossen, Handbook of Marine Craft, section 10.3",
    parameters=tuple(_component(name) for name in ("north", "east", "down")),
    hooks={"water": add_current},
    confusable_with=(
        "buoyancy_offset",
        "linear_drag",
        "position_scale",
        "tether",
        "wave",
    ),
)
