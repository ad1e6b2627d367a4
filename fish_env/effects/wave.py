"""Wave: vertical oscillating flow that decays with depth."""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector
from fish_env.model.tail import TWO_PI
from fish_env.model.trigonometry import exponential, sincos


@kernel
def add_wave(water, place, time, e):
    """Downward flow amplitude exp(-decay z) sin(2 pi frequency t + phase) (m/s, inertial)."""
    sine, _ = sincos(TWO_PI * e.frequency * time + e.phase)
    flow = e.amplitude * exponential(-e.decay * place.z) * sine
    return Vector(water.x, water.y, water.z + flow)


EFFECT = Effect(
    name="wave",
    section="surroundings",
    summary="The fish heaves with the swell, less the deeper it swims.",
    equation="flow_down = amplitude exp(-decay z) sin(2 pi frequency t + phase)",
    source="Airy wave theory, vertical orbital velocity; decay is the wave number",
    parameters=(
        EffectParameter("amplitude", "m/s", 0.0, 0.0, 2.0, (0.005, 0.1), "flow at the surface"),
        EffectParameter(
            "frequency", "Hz", 0.5, 0.0, 10.0, (0.2, 2.0), "wave frequency", shapes=True
        ),
        EffectParameter(
            "phase", "rad", 0.0, -7.0, 7.0, (-3.14, 3.14), "phase at the run's start", shapes=True
        ),
        EffectParameter(
            "decay", "1/m", 1.0, 0.0, 50.0, (0.2, 5.0), "decay with depth", shapes=True
        ),
    ),
    hooks={"water": add_wave},
    confusable_with=(
        "buoyancy_offset",
        "current",
    ),
)
