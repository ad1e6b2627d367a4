"""Channels and commands of a file turned into the model's frame, each from the frame it is in."""

from collections.abc import Mapping

from fish_env.arrays import FloatArray
from fish_env.data.frames import switch_command_frame, switch_frame, switch_noise_frame
from fish_env.data.place import Place
from fish_env.data.table import Column

_FROM_QUATERNION = ("roll", "pitch", "yaw")


def frame_of(name: str, columns: Mapping[str, Column]) -> str:
    """Frame a channel is in; angles that were a quaternion are in its frame."""
    if name in _FROM_QUATERNION and name not in columns:
        return columns["qw"].frame
    return columns[name].frame


def to_model_frame(
    channels: Mapping[str, FloatArray], columns: Mapping[str, Column], place: Place
) -> dict[str, FloatArray]:
    """Converts channels or observations, SI, to the frame of the model.

    Args:
        channels: Values by name, in the frames of their columns.
        columns: The columns they were read from.
        place: The file and run.

    Raises:
        DatasetError: Two channels in different frames are one and the same in the model's.
    """
    enu = {name: a for name, a in channels.items() if frame_of(name, columns) == "enu"}
    switched = switch_frame(enu)
    ned = {name: values for name, values in channels.items() if name not in enu}
    for name in switched:
        if name in ned:
            raise place.at(column=columns[name].name).refuse(
                f"{name} of frame ned is also measured in frame enu, under another name",
                "x and y swap between the frames; give both one frame",
            )
    return ned | switched


def noise_to_model_frame(
    noise: Mapping[str, float], columns: Mapping[str, Column]
) -> dict[str, float]:
    """Converts one-sigma values of channels, SI, to the frame of the model."""
    enu = {name: sigma for name, sigma in noise.items() if frame_of(name, columns) == "enu"}
    return {name: s for name, s in noise.items() if name not in enu} | switch_noise_frame(enu)


def commands_to_model_frame(
    commands: FloatArray, columns: Mapping[str, Column], frame: str
) -> FloatArray:
    """Converts commands, shape (n, 5), SI, to the frame of the model.

    Args:
        commands: In the frame of the file. Of all commands only `tail_offset` depends on it.
        columns: The columns they were read from.
        frame: Frame of the dataset, which holds for a command without a column.
    """
    own = columns["tail_offset"].frame if "tail_offset" in columns else frame
    return switch_command_frame(commands) if own == "enu" else commands
