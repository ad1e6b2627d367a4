"""Readings of a dataset whose clocks or beats are off, with their lines of dataset.yaml."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fish_env.data.retiming import Clocks
from fish_env.diagnosis.inputs.changes import Change


def beat(ratios: Mapping[str, float]) -> Change:
    """The tail beats at other frequencies than commanded: in all runs (""), or in some."""
    clocks = {run: Clocks(beat=ratio) for run, ratio in ratios.items()}
    if "" in ratios:
        value = ratios[""]
        return Change(
            "beat", "tail_frequency", value, "-",
            f"clock: {{beat: {value:.4g}}}",
            f"the tail beats at {value:.4g} times the commanded frequency, all runs taken together",
            clocks=clocks,
        )  # fmt: skip
    values = sorted(ratios.values())
    span = f"{values[0]:.3g}" if len(values) == 1 else f"{values[0]:.3g} to {values[-1]:.3g}"
    line = _of_runs({run: f"beat: {ratio:.4g}" for run, ratio in ratios.items()})
    return Change(
        "beat", "tail_frequency", float(np.mean(values)), "-", line,
        f"the tail beats at {span} times the commanded frequency in {_runs(list(ratios))}",
        clocks=clocks,
    )  # fmt: skip


def clock(scale: float, runs: tuple[str, ...] = ()) -> Change:
    """The clock of the whole log, of commands and measurements alike, is off."""
    own = runs or ("",)
    value = f"scale: {scale:.5g}"
    line = _of_runs(dict.fromkeys(runs, value)) if runs else f"clock: {{{value}}}"
    faster = "slow" if scale > 1.0 else "fast"
    size = f"times {scale:.4g} are seconds"
    return Change(
        "clock", "time", scale, "-", line,
        f"the clock of the log runs {faster}: its times {size}"
        + (f" in {_runs(runs)}" if runs else ""),
        clocks={run: Clocks(scale=scale) for run in own},
    )  # fmt: skip


def _of_runs(values: Mapping[str, str]) -> str:
    """The line that corrects clocks of some runs."""
    entries = [f"{{id: {run}, clock: {{{value}}}}}" for run, value in values.items()]
    return f"runs: [{', '.join(entries)}]"


def _runs(runs: Sequence[str]) -> str:
    named = ", ".join(runs[:4]) + (f" and {len(runs) - 4} more" if len(runs) > 4 else "")
    return f"run{'s' if len(runs) > 1 else ''} {named}"


def skew(scale: float, offset: float, of_commands: bool = True) -> Change:
    """The clocks of commands and measurements differ in rate, or by an offset (s).

    Args:
        scale: what times of commands are to be multiplied by, or times of measurements.
        offset: what is added to the times of commands afterwards, s.
        of_commands: whose clock is wrong.
    """
    shift = f"command_offset: {offset:.3g}"
    if scale == 1.0:
        late = "early" if offset > 0.0 else "late"
        return Change(
            "clock_offset", "command times", offset, "s", f"clock: {{{shift}}}",
            f"the commands are logged {abs(offset):.2g} s too {late} against the measurements",
            clocks={"": Clocks(command_offset=offset)},
        )  # fmt: skip
    key = "command_scale" if of_commands else "measurement_scale"
    what = "commands" if of_commands else "measurements"
    clocks = Clocks(command_offset=offset, **{key: scale})
    return Change(
        "clock_skew", f"{what[:-1]} times", scale, "-",
        f"clock: {{{key}: {scale:.5g}, {shift}}}",
        f"the clock of the {what} is off: its times have to be multiplied by {scale:.4g}",
        clocks={"": clocks},
    )  # fmt: skip
