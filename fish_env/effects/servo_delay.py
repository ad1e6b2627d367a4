"""Servo delay: the tail's servo hears its command late.

The delay acts on the command itself (offset, amplitude, frequency and phase), before anything
that servo and tail make of it: the engine remembers what was told in each physics step and
evaluates it anew, so the delayed angle is exact however often commands change within the delay.
What a fish was told before its run is taken to be the run's first command.
"""

from __future__ import annotations

from fish_env.model.effect import Effect, EffectParameter

EFFECT = Effect(
    name="servo_delay",
    section="actuation",
    summary="The tail does what it was told some time ago: a lag in phase without loss of swing.",
    equation="xi(t) = cmd(t - delay)",
    source="Transport delay: radio link, command buffer and the servo's pulse period (20 ms each)",
    parameters=(
        EffectParameter("delay", "s", 0.0, 0.0, 2.0, (0.01, 0.2), "age of the command obeyed"),
    ),
    command_delay="delay",
    order=3,
    step_error=0.001,
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
