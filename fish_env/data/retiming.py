"""Clocks that are off: times of a run, of its samples alone or of its commands alone, corrected."""

from dataclasses import dataclass

import numpy as np

from fish_env.data.mapping import Section
from fish_env.data.schema import CommandSteps, Run
from fish_env.data.vocabulary import COMMANDS

LONGEST_OFFSET = 3600.0
"""s. Two recorders that are further apart recorded different runs."""
SMALLEST, LARGEST = 0.01, 100.0
"""Scales that a clock can need; a unit of time belongs to the time column."""
_FREQUENCY = list(COMMANDS).index("tail_frequency")


@dataclass(frozen=True)
class Clocks:
    """What the times of a log, and its commanded beats, are to be multiplied by.

    Attributes:
        scale: of every time of the log.
        measurement_scale: of the times of the samples, not of those of the commands.
        command_scale: of the times of the commands, not of those of the samples.
        command_offset: added to the times of the commands, s.
        beat: of the commanded tail frequency.
    """

    scale: float = 1.0
    measurement_scale: float = 1.0
    command_scale: float = 1.0
    command_offset: float = 0.0
    beat: float = 1.0

    @property
    def neutral(self) -> bool:
        """Whether nothing changes."""
        return self == Clocks()


def parse_clocks(section: Section) -> Clocks:
    """Reads `clock` of dataset.yaml or of one of its runs.

    Raises:
        DatasetError: An unknown key, or a number that no clock needs.
    """
    section.allow(["scale", "measurement_scale", "command_scale", "command_offset", "beat"])
    values = {name: section.number(name) for name in section}
    for name, value in values.items():
        if name == "command_offset":
            if abs(value) > LONGEST_OFFSET:
                raise section.at(name).refuse(
                    f"{value:g} s is more than an hour", "Give the offset between two clocks in s"
                )
        elif not SMALLEST <= value <= LARGEST:
            raise section.at(name).refuse(
                f"{value:g} is outside {SMALLEST:g} to {LARGEST:g}",
                "Give what the times have to be multiplied by; 1 leaves them as they are",
            )
    return Clocks(**values)


def retimed(run: Run, clocks: Clocks) -> Run:
    """A run with its clocks corrected.

    Times are counted from the first sample, which keeps its time.

    Args:
        run: As it was logged.
        clocks: What to correct.
    """
    if clocks.neutral:
        return run
    begin, steps = float(run.time_s[0]), run.commands
    samples = (run.time_s - begin) * (clocks.scale * clocks.measurement_scale)
    switches = (steps.times_s - begin) * (clocks.scale * clocks.command_scale)
    values = steps.values.copy()
    values[:, _FREQUENCY] *= clocks.beat
    # A row without any channel is one that only a command had put there.
    measured = np.any([np.isfinite(a) for a in run.channels.values()], axis=0)
    measured[[0, -1]] = True
    return Run.from_steps(
        run.id,
        begin + samples[measured],
        {name: a[measured] for name, a in run.channels.items()},
        CommandSteps(begin + switches + clocks.command_offset, values),
        start=run.start,
        tail_phase=run.tail_phase,
        condition=run.condition,
    )
