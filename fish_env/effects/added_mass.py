"""Added mass: inertia of the water around the body (Kirchhoff, diagonal at O_b)."""

from __future__ import annotations

from fish_env.model.body import flow_drift
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.frames import cross
from fish_env.model.jit import kernel
from fish_env.model.records import Inertia, Vector, Wrench


@kernel
def add_inertia(inertia, tail, fish, e):
    """M + diag(surge, sway, heave, roll, pitch, yaw)."""
    return Inertia(
        inertia.m00 + e.surge,
        inertia.m10,
        inertia.m11 + e.sway,
        inertia.m20,
        inertia.m21,
        inertia.m22 + e.heave,
        inertia.m30,
        inertia.m31,
        inertia.m32,
        inertia.m33 + e.roll,
        inertia.m40,
        inertia.m41,
        inertia.m42,
        inertia.m43,
        inertia.m44 + e.pitch,
        inertia.m50,
        inertia.m51,
        inertia.m52,
        inertia.m53,
        inertia.m54,
        inertia.m55 + e.yaw,
    )


@kernel
def coriolis_and_munk(motion, tail, inputs, centre, fish, e):
    """-omega x (M_A V_rel) - M_A drift; -omega x (I_A omega) - V_rel x (M_A V_rel).

    The drift is d(V_rel)/dt - dV_b/dt = omega x R^T U - R^T DU/Dt: accelerating water exerts the
    force M_A DU/Dt on the fish. The last term is the Munk moment.
    """
    omega = Vector(motion.p, motion.q, motion.r)
    velocity = Vector(motion.u, motion.v, motion.w)
    momentum = Vector(e.surge * motion.u, e.sway * motion.v, e.heave * motion.w)
    spin = Vector(e.roll * motion.p, e.pitch * motion.q, e.yaw * motion.r)
    force = cross(omega, momentum)
    drift = flow_drift(motion)
    gyroscopic = cross(omega, spin)
    munk = cross(velocity, momentum)
    return Wrench(
        -force.x - e.surge * drift.x,
        -force.y - e.sway * drift.y,
        -force.z - e.heave * drift.z,
        -gyroscopic.x - munk.x,
        -gyroscopic.y - munk.y,
        -gyroscopic.z - munk.z,
    )


def _mass(name: str, plausible: tuple[float, float]) -> EffectParameter:
    return EffectParameter(name, "kg", 0.0, 0.0, 50.0, plausible, f"added mass in {name}")


def _inertia(name: str, plausible: tuple[float, float]) -> EffectParameter:
    return EffectParameter(name, "kg m^2", 0.0, 0.0, 5.0, plausible, f"added inertia in {name}")


EFFECT = Effect(
    name="added_mass",
    section="inertia",
    summary="The water adds inertia: the fish accelerates less, and sideslip gives a Munk moment.",
    equation=(
        "F = -M_A dV_rel/dt - omega x (M_A V_rel), "
        "M = -I_A domega/dt - omega x (I_A omega) - V_rel x (M_A V_rel)"
    ),
    source="Lamb, Hydrodynamics, article 124; Fossen, Handbook of Marine Craft, section 6.3",
    parameters=(
        _mass("surge", (0.05, 0.6)),
        _mass("sway", (0.3, 3.0)),
        _mass("heave", (0.3, 3.0)),
        _inertia("roll", (0.0001, 0.003)),
        _inertia("pitch", (0.0005, 0.015)),
        _inertia("yaw", (0.0005, 0.015)),
    ),
    hooks={"inertia": add_inertia, "wrench": coriolis_and_munk},
    confusable_with=(
        "block_reaction",
        "cross_flow_drag",
        "quadratic_damping",
        "tail_reactive",
        "wake_memory",
    ),
)
