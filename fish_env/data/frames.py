"""From the frame `enu` to the model's frame, and back.

`enu` is inertial east, north, up with the body's axes forward, port, up, and Z-Y-X Euler angles
of those axes, so yaw is measured from east towards north. `ned` is inertial north, east, down
with the body's axes forward, starboard, down. The two body frames differ by half a turn about
the forward axis, hence

| quantity | `ned` from `enu` | why |
| --- | --- | --- |
| x, y, z | y, x, -z | north, east, down |
| yaw | pi/2 - yaw | measured from north, turning the other way |
| roll, p, u | unchanged | about and along the shared forward axis |
| pitch, q, yaw rate r | change sign | about axes that are reversed |
| v, w | change sign | along axes that are reversed |
| tail_angle, tail_offset | change sign | angles about the z axis |
| tail_amplitude, tail_frequency | unchanged | magnitudes |
| tail phase | + pi | the swing to port is now the negative half stroke |
| block_displacement, block_angle | unchanged | along and about the forward axis |
| depth | unchanged | a depth grows downwards in either frame |
| sway_speed, heave_speed, yaw_rate, pitch | change sign | as v, w, r and pitch |
| surge_speed, speed, turn_radius | unchanged | along the forward axis, or magnitudes |

Applied twice, the conversion gives the data back, so one function serves both directions.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps, Dataset, Run, SteadyDataset
from fish_env.data.vocabulary import COMMANDS

FRAMES = ("ned", "enu")


_RENAMED = {"x": "y", "y": "x"}
_REVERSED = frozenset(
    ["z", "pitch", "v", "w", "q", "r", "tail_angle", "sway_speed", "heave_speed", "yaw_rate"]
)
_COMMAND_SIGN = np.array([-1.0 if name == "tail_offset" else 1.0 for name in COMMANDS])


def switch_frame(
    channels: Mapping[str, FloatArray],
) -> dict[str, FloatArray]:
    """Converts channels or observations between `enu` and `ned`, either way.

    Args:
        channels: Values by name, SI.

    Returns:
        The converted values by their names in the other frame.
    """
    return {_RENAMED.get(name, name): _switched(name, a) for name, a in channels.items()}


def _switched(name: str, values: FloatArray) -> FloatArray:
    if name == "yaw":
        return math.pi / 2 - values
    return -values if name in _REVERSED else values


def switch_noise_frame(noise: Mapping[str, float]) -> dict[str, float]:
    """Converts one-sigma values, which follow their channel's name but have no sign."""
    return {_RENAMED.get(name, name): sigma for name, sigma in noise.items()}


def switch_command_frame(commands: FloatArray) -> FloatArray:
    """Converts commands, shape (n, 5), between `enu` and `ned`, either way."""
    # Adding zero turns the -0.0 of a reversed zero offset into 0.0.
    switched: FloatArray = commands * _COMMAND_SIGN + 0.0
    return switched


def switch_tail_phase(phase: float | None) -> float | None:
    """Converts a tail phase: the same swing seen from the other side, half a turn on."""
    if phase is None:
        return None
    return phase - math.pi if phase > 0.0 else phase + math.pi


def switch_run_frame(run: Run) -> Run:
    """Converts a run between `enu` and `ned`, either way."""
    return replace(
        run,
        channels=switch_frame(run.channels),
        commands=CommandSteps(run.commands.times_s, switch_command_frame(run.commands.values)),
        tail_phase=switch_tail_phase(run.tail_phase),
    )


def switch_dataset_frame(dataset: Dataset) -> Dataset:
    """Converts a dataset of runs between `enu` and `ned`, either way."""
    return replace(
        dataset,
        runs=tuple(switch_run_frame(run) for run in dataset.runs),
        noise=switch_noise_frame(dataset.noise),
    )


def switch_steady_frame(dataset: SteadyDataset) -> SteadyDataset:
    """Converts a table of steady motion between `enu` and `ned`, either way."""
    return replace(
        dataset,
        commands=switch_command_frame(dataset.commands),
        observations=switch_frame(dataset.observations),
    )
