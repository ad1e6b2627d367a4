"""Inputs of the actuators, changed in one respect."""

from __future__ import annotations

from fish_env.model.jit import kernel
from fish_env.model.records import Inputs


@kernel
def offset_size(inputs):
    """|xi1_bar|, the tail offset without its sign (rad), and its rate (rad/s)."""
    side = 1.0 if inputs.tail_offset > 0.0 else -1.0
    return abs(inputs.tail_offset), side * inputs.tail_offset_rate


@kernel
def with_tail_command(
    inputs, offset, amplitude, frequency, offset_rate, amplitude_rate, frequency_rate
):  # fmt: skip
    """The same inputs with another command of the tail (rad, rad, Hz) and its rates."""
    return Inputs(
        offset,
        amplitude,
        frequency,
        inputs.block_displacement,
        inputs.block_angle,
        offset_rate,
        amplitude_rate,
        frequency_rate,
        inputs.block_displacement_rate,
        inputs.block_angle_rate,
    )


@kernel
def with_tail_frequency(inputs, frequency, rate):
    """The same inputs with another frequency of the tail (Hz) and its rate (Hz/s)."""
    return with_tail_command(
        inputs,
        inputs.tail_offset,
        inputs.tail_amplitude,
        frequency,
        inputs.tail_offset_rate,
        inputs.tail_amplitude_rate,
        rate,
    )


@kernel
def with_block_displacement(inputs, displacement, rate):
    """The same inputs with the block elsewhere (m), moving at another rate (m/s)."""
    return Inputs(
        inputs.tail_offset,
        inputs.tail_amplitude,
        inputs.tail_frequency,
        displacement,
        inputs.block_angle,
        inputs.tail_offset_rate,
        inputs.tail_amplitude_rate,
        inputs.tail_frequency_rate,
        rate,
        inputs.block_angle_rate,
    )
