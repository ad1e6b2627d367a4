"""What the tail's servo was told a while ago, for commands that reach it late.

A *told* command is constant in a physics step but for the rates of offset, amplitude and frequency,
so that remembering it at the start of every step recalls any instant between exactly.

A history is an array of shape (1 + slots * RECORD, N): row 0 counts the steps remembered, then
come the slots, a power of two, used in turn, each with the time (s) at which its step began and
what was told.
Before its first step a fish is taken to have been told the same all along.
"""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.model.grid import Grid
from fish_env.model.inputs import with_tail_command
from fish_env.model.jit import kernel

COMMAND = (
    "offset",
    "amplitude",
    "frequency",
    "offset_rate",
    "amplitude_rate",
    "frequency_rate",
)
"""What the tail is told, in rad, rad, Hz, and their rates."""
HEARD = (*COMMAND, "phase")
"""Rows of what is heard at an instant: what was told a delay ago."""
TOLD = (*HEARD, "delay")
"""Rows of what is told when a step begins, and how late that is heard (s)."""
RECORD = len(TOLD)
"""Numbers of a slot: the time at which a step began (s), then what was told."""

_TWO_PI = 6.283185307179586
_ROUNDING = 1e-9  # s; times closer than this are one
_SAME = 1e-9  # SI units; what is told differs by more where it changes


@kernel
def remember(work, width, told, start, history, first, count):
    """Append what fish first..first+count are told in the step that begins at ``work[start]``."""
    slots = (history.shape[0] - 1) // RECORD
    for k in range(count):
        steps = history[0, first + k]
        row = 1 + RECORD * (int(steps) & (slots - 1))
        history[row, first + k] = work[start * width + k]
        for i in range(1, RECORD):
            history[row + i, first + k] = work[(told + i - 1) * width + k]
        history[0, first + k] = steps + 1.0


@kernel
def recall_at(work, width, k, past, time, edge, ago, history, lane):
    """Set the ``past`` rows of one lane to what its fish was told at a time, some steps ago."""
    slots = (history.shape[0] - 1) // RECORD
    step = told_in(time + edge, ago, history, lane)
    row = 1 + RECORD * (step & (slots - 1))
    since = time - history[row, lane]
    moving = 0.0 if since < -_ROUNDING else 1.0
    for i in range(3):
        rate = moving * history[row + 4 + i, lane]
        work[(past + i) * width + k] = history[row + 1 + i, lane] + since * rate
        work[(past + 3 + i) * width + k] = rate
    mean = 0.5 * (history[row + 3, lane] + work[(past + 2) * width + k])
    work[(past + 6) * width + k] = history[row + 7, lane] + _TWO_PI * mean * since


@kernel
def told_in(time, ago, history, lane):
    """The step in which a fish was told what it was at a time, the first kept at the earliest."""
    slots = (history.shape[0] - 1) // RECORD
    newest = int(history[0, lane]) - 1
    oldest = max(0, newest + 1 - slots)
    step = max(oldest, newest - int(min(ago, float(slots))))
    while (step > oldest) & (history[1 + RECORD * (step & (slots - 1)), lane] > time):
        step -= 1
    while step < newest and history[1 + RECORD * ((step + 1) & (slots - 1)), lane] <= time:
        step += 1
    return step


@kernel
def told_anew(time, length, ago, history, lane):
    """How long after a time a fish was told something else, or to move at another rate (s).

    Args:
        time: when (s).
        length: how far to look (s).
        ago: about how many steps ago that was.
        history: see above.
        lane: which fish.

    Returns:
        The time from then; infinite where there is none within the length.
    """
    slots = (history.shape[0] - 1) // RECORD
    newest = int(history[0, lane]) - 1
    step = told_in(time + _ROUNDING, ago, history, lane)
    found = np.inf
    while (found == np.inf) & (step < newest):
        row = 1 + RECORD * (step & (slots - 1))
        after = 1 + RECORD * ((step + 1) & (slots - 1))
        begin = history[after, lane]
        if begin >= time + length - _ROUNDING:
            break
        lasted = begin - history[row, lane]
        for i in range(3):
            rate = history[row + 4 + i, lane]
            jump = history[after + 1 + i, lane] - (history[row + 1 + i, lane] + lasted * rate)
            kink = history[after + 4 + i, lane] - rate
            if (abs(jump) > _SAME) | (abs(kink) > _SAME):
                found = begin - time
        step += 1
    return found


@kernel
def assume_running(work, width, told, past):
    """Set the ``past`` rows as if every fish had always been told what it is told now."""
    for k in range(width):
        late = work[(told + RECORD - 1) * width + k]
        for i in range(3):
            work[(past + i) * width + k] = work[(told + i) * width + k]
            work[(past + 3 + i) * width + k] = 0.0
        turned = _TWO_PI * work[(told + 2) * width + k] * late
        work[(past + 6) * width + k] = work[(told + 6) * width + k] - turned


@kernel
def late_command(
    late, inputs, phase, offset, amplitude, frequency, offset_rate, amplitude_rate,
    frequency_rate, past_phase,
):  # fmt: skip
    """Inputs and phase that reach the tail: those recalled if they come late, else those of now."""
    on = late > 0.0
    heard = with_tail_command(
        inputs,
        offset if on else inputs.tail_offset,
        amplitude if on else inputs.tail_amplitude,
        frequency if on else inputs.tail_frequency,
        offset_rate if on else inputs.tail_offset_rate,
        amplitude_rate if on else inputs.tail_amplitude_rate,
        frequency_rate if on else inputs.tail_frequency_rate,
    )
    return heard, past_phase if on else phase


@kernel
def running_command(inputs, phase, late):
    """Inputs and phase that reach the tail when the present command has been running all along."""
    heard = with_tail_command(
        inputs, inputs.tail_offset, inputs.tail_amplitude, inputs.tail_frequency, 0.0, 0.0, 0.0
    )
    return heard, phase - _TWO_PI * inputs.tail_frequency * late


def history_rows(longest_delay: float, shortest_step: float) -> int:
    """Rows of a history that reaches back far enough for steps of this size or longer (s)."""
    if longest_delay <= 0.0:
        return 0
    return _rows(int(np.ceil(longest_delay / shortest_step)) + 2)


def history_rows_on(grid: Grid, longest_delay: float) -> int:
    """Rows of a history that reaches back far enough on this grid."""
    if longest_delay <= 0.0:
        return 0
    counts: IntArray = grid.steps
    index = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    begins = np.repeat(grid.starts, counts) + index * np.repeat(grid.sizes, counts)
    reached = np.searchsorted(begins, begins - longest_delay - 2 * _ROUNDING)
    return _rows(int(np.max(np.arange(begins.size) - reached)) + 3)


def _rows(slots: int) -> int:
    return 1 + RECORD * (1 << (slots - 1).bit_length())


def forget(history: FloatArray, lanes: IntArray, rows: int) -> FloatArray:
    """Let fish begin anew, as told nothing yet.

    Args:
        history: (rows, N), changed in place if it is long enough.
        lanes: (k,) which fish.
        rows: how many rows they need.

    Returns:
        The history, or a longer one that holds what the other fish were told.
    """
    if rows > len(history):
        history = _lengthened(history, rows)
    if len(history):
        history[0, lanes] = 0.0
    return history


def _lengthened(history: FloatArray, rows: int) -> FloatArray:
    longer = np.zeros((rows, history.shape[1]))
    if not len(history):
        return longer
    longer[0] = history[0]
    slots, more = (len(history) - 1) // RECORD, (rows - 1) // RECORD
    for age in range(1, slots + 1):
        step = history[0].astype(int) - age
        lanes = np.flatnonzero(step >= 0)
        for i in range(1, RECORD + 1):
            told = history[RECORD * (step[lanes] % slots) + i, lanes]
            longer[RECORD * (step[lanes] % more) + i, lanes] = told
    return longer
