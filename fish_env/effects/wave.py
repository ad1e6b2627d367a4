"""Wave: the orbital flow of a small-amplitude surface wave, and its pressure gradient.

Airy's theory for water of depth H, with z down from the surface, the phase
theta = omega t - k (x cos(heading) + y sin(heading)) + phase and omega = 2 pi frequency:

    U_down  = amplitude sinh(k (H - z)) / sinh(k H) sin(theta)
    U_along = amplitude cosh(k (H - z)) / sinh(k H) cos(theta)
    omega^2 = g k tanh(k H)

In deep water both amplitudes fall as exp(-k z), with k = omega^2 / g. All drag and lift act on the
velocity relative to U. The pressure gradient of the wave also acts on the hull, as on the water
that the hull displaces: F = m_b DU/Dt, with DU/Dt the acceleration along the path of the water. The
effect ``added_mass`` adds M_A DU/Dt.
"""

from __future__ import annotations

import math
from math import inf, pi

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Vector, Wrench
from fish_env.model.tail import TWO_PI
from fish_env.model.trigonometry import exponential, sincos

GRAVITY = 9.81
"""m/s^2, for the dispersion of waves."""


@kernel
def wave_number(omega, tank_depth):
    """Wave number k (1/m) with omega^2 = g k tanh(k H), to about 1e-12.

    Newton's method from Eckart's approximation k0 / sqrt(tanh(k0 H)), k0 = omega^2 / g.
    """
    deep = omega * omega / GRAVITY
    finite = (tank_depth < inf) & (deep > 0.0)
    depth = tank_depth if finite else 1.0
    fading = exponential(-2.0 * deep * depth)
    k = deep * math.sqrt((1.0 + fading) / (1.0 - fading if finite else 1.0))
    for _ in range(3):
        fading = exponential(-2.0 * k * depth)
        tanh = (1.0 - fading) / (1.0 + fading)
        slope = tanh + k * depth * (1.0 - tanh * tanh)
        k -= (k * tanh - deep) / (slope if finite else 1.0)
    return k if finite else deep


@kernel
def orbit(place, time, e):
    """Wave number (1/m), heading (cosine, sine), level and vertical amplitude (m/s), sin and cos.

    The amplitudes are those at the depth of the point; above the surface, those at the
    surface. Sine and cosine are of the phase of the wave there.
    """
    omega = TWO_PI * e.frequency
    k = wave_number(omega, e.tank_depth)
    east, north = sincos(e.heading)
    finite = (e.tank_depth < inf) & (k > 0.0)
    depth = max(place.z, 0.0)
    mirror = exponential(-2.0 * k * (e.tank_depth if finite else 0.0)) if finite else 0.0
    size = e.amplitude / (1.0 - mirror)
    falling = exponential(-k * depth)
    rising = mirror / falling
    sine, cosine = sincos(omega * time - k * (north * place.x + east * place.y) + e.phase)
    return k, north, east, size * (falling + rising), size * (falling - rising), sine, cosine


@kernel
def add_wave(water, place, time, e):
    """U of the wave added to the water's velocity (m/s, inertial)."""
    _, north, east, level, deep, sine, cosine = orbit(place, time, e)
    along = level * cosine
    return Vector(water.x + north * along, water.y + east * along, water.z + deep * sine)


@kernel
def add_acceleration(rate, water, place, time, e):
    """DU/Dt = dU/dt + (U . grad) U of the wave in all of the water's flow (m/s^2, inertial)."""
    k, north, east, level, deep, sine, cosine = orbit(place, time, e)
    turning = TWO_PI * e.frequency - k * (north * water.x + east * water.y)
    sinking = k * water.z
    along = -level * turning * sine - deep * sinking * cosine
    down = deep * turning * cosine - level * sinking * sine
    return Vector(rate.x + north * along, rate.y + east * along, rate.z + down)


@kernel
def push_by_pressure(motion, tail, inputs, centre, fish, e):
    """m_b DU/Dt at O_b, the centre of buoyancy (N, body)."""
    mass = centre.buoyancy_mass if e.amplitude != 0.0 else 0.0
    return Wrench(
        mass * motion.water_rate_u,
        mass * motion.water_rate_v,
        mass * motion.water_rate_w,
        0.0,
        0.0,
        0.0,
    )


def _shape(
    name: str, unit: str, neutral: float, lower: float, upper: float,
    plausible: tuple[float, float], description: str,
) -> EffectParameter:  # fmt: skip
    return EffectParameter(name, unit, neutral, lower, upper, plausible, description, shapes=True)


EFFECT = Effect(
    name="wave",
    section="surroundings",
    summary="The fish moves with the orbital flow of the waves, less at greater depth.",
    equation=(
        "U_down = amplitude sinh(k(H-z))/sinh(kH) sin(theta), "
        "U_along = amplitude cosh(k(H-z))/sinh(kH) cos(theta), "
        "theta = 2 pi frequency t - k (x cos heading + y sin heading) + phase, "
        "(2 pi frequency)^2 = g k tanh(kH), F = m_b DU/Dt beside the drag on V_b - R^T U"
    ),
    source=(
        "Airy wave theory: Dean and Dalrymple, Water Wave Mechanics, chapters 3 and 4; force by "
        "the pressure gradient: Newman, Marine Hydrodynamics, section 2.13"
    ),
    parameters=(
        EffectParameter(
            "amplitude", "m/s", 0.0, 0.0, 2.0, (0.005, 0.1), "vertical flow at the surface"
        ),
        _shape("frequency", "Hz", 0.5, 0.0, 10.0, (0.2, 2.0), "wave frequency"),
        _shape("phase", "rad", 0.0, -7.0, 7.0, (-pi, pi), "phase at the origin at the start"),
        _shape("heading", "rad", 0.0, -7.0, 7.0, (-3.0, 3.0), "direction of travel, from north"),
        EffectParameter(
            "tank_depth",
            "m",
            inf,
            0.05,
            inf,
            (0.5, 5.0),
            "depth H of the water",
            shapes=True,
            probed=False,
        ),
    ),
    hooks={
        "water": add_wave,
        "water_rate": add_acceleration,
        "wrench": push_by_pressure,
    },
    confusable_with=(
        "buoyancy_offset",
        "current",
    ),
)
