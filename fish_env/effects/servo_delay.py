"""Servo delay: the tail's servo receives its command late.

The delay acts on the command (offset, amplitude, frequency and phase), before all other effects of
servo and tail. The engine stores the command of each physics step and evaluates it again, so the
delayed angle is exact even if commands change often within the delay. Before the run, the command
is taken to be the first of the run.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter

EFFECT = Effect(
    name="servo_delay",
    section="actuation",
    summary="The tail follows its command late: a phase lag without loss of amplitude.",
    equation="xi(t) = cmd(t - delay)",
    source="Transport delay: radio link, command buffer and the servo's pulse period (20 ms each)",
    parameters=(
        EffectParameter(
            "delay", "s", 0.0, 0.0, 2.0, (0.01, 0.2), "age of the command that is followed"
        ),
    ),
    command_delay="delay",
    order=3,
    confusable_with=(
        "clock_scale",
        "clock_skew",
        "sensor_delay",
        "servo_backlash",
        "servo_lag",
        "tail_flexibility",
        "wake_memory",
    ),
)
