"""What a replay shows of one fish: its pose for drawing, and its channels for plotting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps, Run
from fish_env.data.units import unwrap_angle
from fish_env.model.state import INPUTS
from fish_env.replay.frames import Frames, filled, frames_of
from fish_env.trajectory import Trajectory

Role = Literal["measured", "baseline", "extended", "goal", "other"]
POSITION, ATTITUDE = ("x", "y", "z"), ("roll", "pitch", "yaw")
SHOWN = (*POSITION, *ATTITUDE, "u", "v", "w", "p", "q", "r")


@dataclass(frozen=True, eq=False)
class Motion:
    """One fish of a replay.

    Attributes:
        name: Shown in the legend.
        role: What it is; decides its colour.
        frames: Pose, tail and block on an even clock, for drawing.
        time_s: Times of the channels, shape (n,), s.
        channels: For the plots, each (n,), SI, NaN where missing; those of
            :data:`fish_env.data.CHANNELS`, and ``speed``.
        notes: What is drawn but was not known.
    """

    name: str
    role: Role
    frames: Frames
    time_s: FloatArray
    channels: Mapping[str, FloatArray]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Group:
    """Motions that are shown together.

    Attributes:
        name: Shown in the list of what can be chosen.
        motions: They share one clock.
    """

    name: str
    motions: tuple[Motion, ...]


def motion_from_trajectory(
    trajectory: Trajectory,
    name: str,
    role: Role = "other",
    tail_angle: FloatArray | None = None,
    channels: Mapping[str, FloatArray] | None = None,
) -> Motion:
    """The motion of a simulated fish.

    Args:
        trajectory: Simulated, at 20 Hz or more for a smooth tail.
        name: For the legend.
        role: For the colour.
        tail_angle: (T,) rad; default: as commanded, without what servos and water do to it.
        channels: For the plots, as sensors would report them; default: the true ones.
    """
    inputs = dict(zip(INPUTS, trajectory.inputs.T, strict=True))
    if tail_angle is None:
        phase = trajectory["tail_phase"]
        tail_angle = inputs["tail_offset"] + inputs["tail_amplitude"] * np.sin(phase)
    frames = frames_of(
        trajectory.time_s,
        trajectory.states[:, 0:3],
        Rotation.from_quat(trajectory.states[:, 3:7], scalar_first=True),
        tail_angle,
        np.column_stack([inputs["block_displacement"], inputs["block_angle"]]),
    )
    plotted = dict(channels or trajectory.channels) | {"tail_angle": tail_angle}
    return Motion(name, role, frames, trajectory.time_s, with_speed(plotted))


def motion_from_run(run: Run, name: str = "measured", role: Role = "measured") -> Motion:
    """The motion of a measured fish. What was not measured is drawn at rest, and said so.

    Args:
        run: Measured run.
        name: For the legend.
        role: For the colour.
    """
    return motion_from_channels(run.time_s, run.channels, name, role, run.commands, run.tail_phase)


def motion_from_channels(
    time_s: FloatArray,
    channels: Mapping[str, FloatArray],
    name: str,
    role: Role,
    commands: CommandSteps | None = None,
    tail_phase: float | None = None,
) -> Motion:
    """The motion of a fish of which only some channels are known.

    Args:
        time_s: Times, shape (n,), s.
        channels: Any of :data:`fish_env.data.CHANNELS`, each (n,), SI, NaN where missing.
        name: For the legend.
        role: For the colour.
        commands: What was asked of the servos; without them tail and block are drawn at rest,
            unless ``tail_angle`` is a channel.
        tail_phase: Tail phase at the first time, rad; None where it is not known.
    """
    known = {n: unwrap_angle(v) if n in ("roll", "yaw") else v for n, v in channels.items()}
    still = np.zeros(len(time_s))
    position = np.column_stack([filled(time_s, known.get(n, still)) for n in POSITION])
    angles = np.column_stack([filled(time_s, known.get(n, still)) for n in ATTITUDE])
    fine, tail, block = _actuators(time_s, known, commands, tail_phase)
    frames = frames_of(
        time_s, position, Rotation.from_euler("ZYX", angles[:, ::-1]), tail, block, fine
    )
    notes = _notes(known, commands, tail_phase)
    return Motion(name, role, frames, time_s, with_speed(known), notes)


def motion_of_goals(fish: Motion, time_s: FloatArray, goals: Mapping[str, FloatArray]) -> Motion:
    """What a fish was to do, beside what it did: a second fish at the goal's depth and heading.

    Args:
        fish: The fish. The goals have no place in the plane, so they are drawn at its place.
        time_s: Times of the goals, (n,), s.
        goals: ``z`` (m), ``yaw`` (rad, may jump by whole turns) and ``speed`` (m/s), each (n,).
    """
    frames = fish.frames
    clock = frames.start_s + frames.step_s * np.arange(len(frames.position))
    depth, heading = (
        np.interp(clock, time_s, values) for values in (goals["z"], np.unwrap(goals["yaw"]))
    )
    level = Rotation.from_euler("ZYX", np.outer(heading, (1.0, 0.0, 0.0)))
    ghost = Frames(
        frames.start_s,
        frames.step_s,
        np.column_stack([frames.position[:, :2], depth]),
        level.as_quat(scalar_first=True),
        np.zeros(len(clock)),
        np.zeros((len(clock), 2)),
    )
    near = 2.0 * np.pi * np.round((_mean(fish, "yaw") - heading.mean()) / (2.0 * np.pi))
    channels = {**goals, "yaw": np.unwrap(goals["yaw"]) + near}
    note = "goal depth and heading are drawn at the fish's place in the plane"
    return Motion("goal", "goal", ghost, time_s, channels, (note,))


def _mean(motion: Motion, name: str) -> float:
    values = motion.channels.get(name)
    return 0.0 if values is None else float(np.nanmean(np.unwrap(values)))


def with_speed(channels: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Channels, and the speed where all of u, v and w are among them."""
    if not {"u", "v", "w"} <= set(channels):
        return dict(channels)
    speed = np.sqrt(sum(channels[n] ** 2 for n in ("u", "v", "w")))
    return {**channels, "speed": speed}


def _actuators(
    time_s: FloatArray,
    channels: Mapping[str, FloatArray],
    commands: CommandSteps | None,
    tail_phase: float | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A clock for tail and block, the tail's angle, and the block's two commands."""
    if commands is None:
        tail = filled(time_s, channels.get("tail_angle", np.zeros(len(time_s))))
        return time_s, tail, np.zeros((len(time_s), 2))
    fine = np.linspace(time_s[0], time_s[-1], max(2, int(100 * (time_s[-1] - time_s[0]))))
    values = commands.at(fine)
    if "tail_angle" in channels:
        tail = np.interp(fine, time_s, filled(time_s, channels["tail_angle"]))
    else:
        turns = np.concatenate([[0.0], np.cumsum(values[:-1, 2] * np.diff(fine))])
        tail = values[:, 0] + values[:, 1] * np.sin((tail_phase or 0.0) + 2.0 * np.pi * turns)
    return fine, tail, values[:, 3:5]


def _notes(
    channels: Mapping[str, FloatArray], commands: CommandSteps | None, tail_phase: float | None
) -> tuple[str, ...]:
    notes = []
    absent = [n for n in (*POSITION, *ATTITUDE) if n not in channels]
    if absent:
        notes.append(f"not measured and drawn as 0: {', '.join(absent)}")
    if any(np.isnan(channels[n]).any() for n in (*POSITION, *ATTITUDE) if n in channels):
        notes.append("gaps in the pose are bridged for the drawing, not in the plots")
    if "tail_angle" not in channels:
        if commands is None:
            notes.append("tail and block are not in the file and drawn at rest")
        elif tail_phase is None:
            notes.append("the tail is drawn as commanded, from an unknown phase")
        else:
            notes.append("the tail is drawn as commanded")
    return tuple(notes)
