"""Tail flexibility: the tail follows its root as a damped second-order system."""

from __future__ import annotations

from math import inf, sqrt

from fish_env.model.corners import followed
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Tail
from fish_env.model.tail import TWO_PI


@kernel
def bend(tail, inputs, phase, time, fish, e, states):
    """d2(xi)/dt2 = w^2 (cmd - xi) - 2 zeta w d(xi)/dt, w = 2 pi natural_frequency."""
    angle, rate = states
    on = e.natural_frequency < inf
    omega = TWO_PI * (e.natural_frequency if on else 1.0)
    acceleration = omega * (omega * (tail.angle - angle) - 2.0 * e.damping_ratio * rate)
    seen = Tail(
        angle if on else tail.angle,
        rate if on else tail.rate,
        acceleration if on else tail.acceleration,
    )
    return seen, (rate if on else 0.0, acceleration if on else 0.0)


@kernel
def turns(e):
    """Whether it is on."""
    return e.natural_frequency < inf


@kernel
def settling(tail, e, states):
    """A jump of the command makes the tail swing for a few periods, or creep.

    What it leaves over is how far angle and rate are from those behind a smooth command.
    """
    angle, rate = states
    on = e.natural_frequency < inf
    omega = TWO_PI * (e.natural_frequency if on else 1.0)
    zeta = max(e.damping_ratio, 1.0)
    fastest = 1.0 / (omega * (zeta + sqrt(zeta * zeta - 1.0)))
    late = 2.0 * e.damping_ratio / omega
    bent = (late * late - 1.0 / (omega * omega)) * tail.acceleration
    slow = rate - tail.rate + late * tail.acceleration
    excess = abs(slow) + omega * abs(tail.angle - angle - late * tail.rate + bent)
    return followed(fastest, excess) if on else inf


@kernel
def start_unbent(inputs, tail, fish, e):
    """The run starts with the tail undeformed and at rest."""
    return tail.angle, 0.0


def fastest(values):
    """Inverse of the larger eigenvalue; infinite when the effect is off."""
    if values["natural_frequency"] == inf:
        return inf
    zeta = max(values["damping_ratio"], 1.0)
    return 1.0 / (TWO_PI * values["natural_frequency"] * (zeta + sqrt(zeta * zeta - 1.0)))


STIFF_HZ = 8.0
"""Natural frequency above which a tail is stiffer than any that bends."""


def lags(values):
    """Overdamped, its response is two lags in a row; the shorter is nearly a delay.

    Of a stiff tail only the lag 2 damping_ratio / w is left: beats do not reach its resonance.
    """
    zeta, omega = values["damping_ratio"], TWO_PI * values["natural_frequency"]
    if omega == inf:
        return {}
    if zeta < 1.0:
        stiff = omega > TWO_PI * STIFF_HZ
        return {"servo_lag": {"time_constant": 2.0 * zeta / omega}} if stiff else {}
    root = sqrt(zeta * zeta - 1.0)
    shorter, longer = (zeta - root) / omega, (zeta + root) / omega
    return {"servo_lag": {"time_constant": longer}, "servo_delay": {"delay": shorter}}


EFFECT = Effect(
    name="tail_flexibility",
    section="actuation",
    summary="A flexible tail: larger amplitude near its resonance, and phase lag above it.",
    equation="xi'' + 2 damping_ratio w xi' + w^2 xi = w^2 cmd, w = 2 pi natural_frequency",
    source="Pseudo-rigid-body model, Howell, Compliant Mechanisms, chapter 5",
    parameters=(
        EffectParameter(
            "natural_frequency", "Hz", inf, 0.1, inf, (3.0, STIFF_HZ), "in water, undamped"
        ),
        EffectParameter(
            "damping_ratio", "-", 1.0, 0.05, 5.0, (0.2, 1.2), "1 is critical", shapes=True
        ),
    ),
    hooks={"tail": bend},
    states={"tail": ("angle", "rate")},
    initial_states=start_unbent,
    turns=turns,
    settling=settling,
    time_scale=fastest,
    order=7,
    confusable_with=(
        "body_flexibility",
        "servo_delay",
        "servo_lag",
        "tail_gain",
        "tail_reactive",
        "wake_memory",
    ),
    parts=lags,
)
