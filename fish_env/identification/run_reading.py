"""Reads a measured run for the filter: its rows, commands, steps and initial state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import Run
from fish_env.errors import DatasetError
from fish_env.identification.channels import BY_NAME, Kind
from fish_env.identification.command_jumps import SAME_INSTANT_S, jumped, just_after
from fish_env.identification.first_state import first_state
from fish_env.identification.policy import IDENTIFICATION
from fish_env.identification.runs import BEFORE_S, FINER, FREQUENCY, RunData, steps_between
from fish_env.identification.thinning import kept_rows


def prepare_run(
    run: Run,
    channels: Sequence[str],
    noise_sd: FloatArray,
    dt: float = 0.01,
    noise_scale: FloatArray | None = None,
) -> RunData:
    """Read a run for the filter, thinned where it comes faster than a beat needs.

    Args:
        run: measured run.
        channels: channels to use.
        noise_sd: (C,) white noise of each channel, for the spread of the initial state.
        dt: longest RK4 step (s), but for a moment after each jump of the commands.
        noise_scale: (C,) by how much more noise this run has; default: as much.

    Raises:
        DatasetError: the run has none of the channels.
    """
    if not channels:
        raise DatasetError(f"run {run.id}: none of {', '.join(BY_NAME)} is measured")
    clock, measured = _merged(
        run.time_s - run.time_s[0], np.column_stack([run.channels[name] for name in channels])
    )
    scale = np.ones(1) if noise_scale is None else noise_scale
    state0, covariance0 = first_state(run, channels, measured, clock, noise_sd * scale)
    kept = kept_rows(clock, measured, float(run.commands.values[:, FREQUENCY].max()))
    clock, measured = clock[kept], measured[kept]
    switches = run.commands.times_s - run.time_s[0]
    fresh = just_after(switches[jumped(run.commands.values)], clock)
    substeps = steps_between(clock, np.where(fresh, dt / FINER, dt))
    if run.start == "rest":
        measured[clock < IDENTIFICATION.untold_start_s] = np.nan
    # Where the tail is at the first sample is known only once it has moved.
    measured[0, [BY_NAME[name].kind == Kind.DRIVE for name in channels]] = np.nan
    prepared = RunData(
        run.id,
        run.condition,
        clock,
        substeps,
        fresh,
        *_commands(run, switches),
        np.ascontiguousarray(measured),
        state0,
        covariance0,
        run.tail_phase is not None,
        run.start != "rest",
        noise_scale=scale,
    )
    return prepared.movable(channels)


def _commands(run: Run, switches: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Switch times (m,) and commands (m, 5), from before the run on where it starts from rest.

    Late samples show a time before the run. The fish was then held as first commanded, but for
    its beat, which had not begun.
    """
    values = run.commands.values
    if run.start == "rest":
        held = values[:1].copy()
        held[0, FREQUENCY] = 0.0
        switches, values = np.r_[switches[0] - BEFORE_S, switches], np.vstack([held, values])
    return np.ascontiguousarray(switches), np.ascontiguousarray(values)


def _merged(clock: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows at one instant, but for rounding, made one: a command and a sample may each have one."""
    apart = np.diff(clock, prepend=-np.inf) > SAME_INSTANT_S
    first = np.flatnonzero(apart)
    merged = measured[first]
    for row in np.flatnonzero(~apart):
        at = int(np.searchsorted(first, row, side="right")) - 1
        merged[at] = np.where(np.isfinite(merged[at]), merged[at], measured[row])
    return clock[first], merged
