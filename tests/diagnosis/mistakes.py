"""Mistakes that people make in data and their descriptions, put into datasets one at a time.

The measurements are those of the hidden cases, which another implementation of the physics makes.
A mistake is made here by hand, not by the code that puts it right.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from fish_env.data import CHANNELS, COMMANDS, CommandSteps, Dataset, Run, load_dataset
from fish_env.data.units import SI_UNIT
from fish_env.inference.input_faults import InputFault
from tests.hidden.cases import make_case

SENSORS = {
    "nine channels": ("null", 0, ()),
    "overhead camera": ("null_camera", 0, ("x", "y", "yaw")),
    "gyro, compass and depth": ("null_designs", 8, ()),
    "speeds, attitude and depth": ("null_designs", 10, ()),
}
"""Tier, which of its kinds, and the channels kept; all of them if none are named."""
ROUND = 18
"""Kinds that the tiers go through in order: seeds are multiples of it, plus the kind."""
FACTORS = (0.2, 0.5, 0.75, 1.3, 2.1, 5.0)
SIGNED = ("tail_offset", "block_displacement", "block_angle")
LEFT_HANDED = ("y", "v", "roll", "yaw", "p", "r")
SI = {name: SI_UNIT[quantity.dimension] for name, quantity in {**CHANNELS, **COMMANDS}.items()}
Spoil = Callable[[Run], Run]


@dataclass(frozen=True)
class Mistake:
    """One mistake.

    Attributes:
        spoil: makes it, in a run.
        lines: any of which puts it right; the number that belongs to it is `value`.
        value: factor or offset that the line must name, within 1 %; None if it has none.
        runs: ids of the runs that it is made in; empty for all.
    """

    spoil: Spoil
    lines: tuple[str, ...]
    value: float | None = None
    runs: tuple[str, ...] = ()

    def applied(self, dataset: Dataset) -> Dataset:
        """A dataset with the mistake in it."""
        runs = tuple(
            self.spoil(run) if not self.runs or run.id in self.runs else run for run in dataset.runs
        )
        return replace(dataset, runs=runs, noise={})


@cache
def sensed(sensors: str, first: int) -> Dataset:
    """A good dataset of one kind of sensors."""
    tier, kind, channels = SENSORS[sensors]
    with tempfile.TemporaryDirectory() as place:
        make_case(tier, first - first % ROUND + kind, Path(place) / "data")
        dataset = load_dataset(Path(place) / "data")
    assert isinstance(dataset, Dataset)
    if not channels:
        return dataset
    runs = tuple(
        replace(run, channels={name: run.channels[name] for name in channels})
        for run in dataset.runs
    )
    return replace(dataset, runs=runs, noise={})


def found_by(mistake: Mistake, faults: Sequence[InputFault]) -> bool:
    """Whether exactly one decisive fault was found, with a line that puts the mistake right."""
    telling = [fault for fault in faults if fault.decisive]
    if len(telling) != 1:
        return False
    fault = telling[0]
    said = [
        line for line in (fault.fix, *fault.alternatives)
        if any(line.startswith(begin) for begin in mistake.lines)
    ]  # fmt: skip
    if mistake.value is None or not said:
        return bool(said)
    named = _number(said[0])
    near = 0.08 if fault.kind == "clock_offset" else 0.01 * abs(mistake.value)
    return abs(named - mistake.value) < near


def _number(line: str) -> float:
    """The first number after a colon in a line."""
    for word in line.replace("}", " ").replace(",", " ").split():
        try:
            return float(word)
        except ValueError:
            continue
    raise ValueError(line)


def mistakes_of(dataset: Dataset) -> dict[str, Mistake]:
    """The mistakes that a dataset's channels can show, by name."""
    channels, planar = dataset.channels, "z" not in dataset.channels
    found = {}
    for name in channels:
        found[f"{name} reversed"] = Mistake(
            column(name, -1.0), (f"channels: {{{name}: {{unit: {SI[name]}, sign: -1}}}}",)
        )
        factor, coarse, fine = UNITS[name[0] if name in ("x", "y", "z", "u", "v", "w") else "a"]
        if name in ("p", "q", "r"):
            coarse, fine = "rad/s", "deg/s"
        elif name in ("u", "v", "w"):
            coarse, fine = "m/s", "mm/s"
        found[f"{name} in the finer unit"] = Mistake(
            column(name, factor), (f"channels: {{{name}: {fine}}}",)
        )
        found[f"{name} in the coarser unit"] = Mistake(
            column(name, 1.0 / factor), (f"channels: {{{name}: {coarse}}}",)
        )
    for name in SIGNED:
        # A block that moves shows neither to a camera overhead.
        if not planar or name == "tail_offset":
            if name == "block_angle" and not {"roll", "p"} & set(channels):
                continue
            line = (f"commands: {{{name}: {{unit: {SI[name]}, sign: -1}}}}",)
            found[f"{name} reversed"] = Mistake(command(name, -1.0), line)
    found |= _frames(dataset) | _times(dataset)
    return found


UNITS = {
    **dict.fromkeys("xyz", (1e3, "m", "mm")),
    **dict.fromkeys("uvw", (1e3, "m/s", "mm/s")),
    "a": (np.degrees(1.0), "rad", "deg"),
}


def _frames(dataset: Dataset) -> dict[str, Mistake]:
    found = {}
    if {"roll", "yaw"} <= set(dataset.channels):
        found["commands exchanged"] = Mistake(
            crossed, ("commands: {tail_offset: {unit: rad, column: block_angle}",)
        )
        own = [name for name in LEFT_HANDED if name in dataset.channels]
        signs = ", ".join(f"{name}: {{unit: {SI[name]}, sign: -1}}" for name in own)
        found["mirrored"] = Mistake(mirrored, (f"channels: {{{signs}}}",))
    if {"x", "y"} <= set(dataset.channels):
        found["x and y exchanged"] = Mistake(exchanged, ("channels: {x: {unit: m, column: y}",))
    if {"z", "pitch"} <= set(dataset.channels):
        # Sensors alone cannot tell a mirrored world from blocks and depth that are reversed.
        found["frame enu"] = Mistake(as_enu, ("frame: enu",))
    return found


def _times(dataset: Dataset) -> dict[str, Mistake]:
    found, last = {}, dataset.ids[-1:]
    for factor in FACTORS:
        clock = Mistake(times(factor, factor), ("clock: {scale",), factor)
        beat = Mistake(command("tail_frequency", 1.0 / factor), ("clock: {beat",), factor)
        if "z" not in dataset.channels:
            # By the beat alone a camera cannot tell one from the other.
            both = ("clock: {scale", "clock: {beat")
            clock, beat = replace(clock, lines=both), replace(beat, lines=both)
        found[f"clock {factor}"] = clock
        found[f"beat {factor}"] = beat
        found[f"clock of the commands {factor}"] = Mistake(
            times(1.0, factor), ("clock: {command_scale",), factor
        )
        found[f"clock of the measurements {factor}"] = Mistake(
            times(factor, 1.0), ("clock: {measurement_scale",), factor
        )
    for offset in (-3.0, -0.4, 0.3, 1.5):
        found[f"commands {offset} s late"] = Mistake(
            late(offset), ("clock: {command_offset",), -offset
        )
    for factor in (0.75, 1.3):
        found[f"beat {factor} in one run"] = Mistake(
            command("tail_frequency", 1.0 / factor),
            (f"runs: [{{id: {last[0]}, clock: {{beat",),
            None,
            last,
        )
    return found


def column(name: str, factor: float) -> Spoil:
    """A channel times a factor."""
    return lambda run: replace(
        run, channels={**run.channels, name: _wrapped(name, factor * run.channels[name])}
    )


def _wrapped(name: str, values: np.ndarray) -> np.ndarray:
    return np.clip(values, -1.5, 1.5) if name == "pitch" else values


def command(name: str, factor: float) -> Spoil:
    """A command times a factor."""
    factors = np.array([factor if known == name else 1.0 for known in COMMANDS])
    return lambda run: replace(
        run, commands=CommandSteps(run.commands.times_s, run.commands.values * factors)
    )


def exchanged(run: Run) -> Run:
    """x and y in each other's columns."""
    x, y = run.channels["x"], run.channels["y"]
    return replace(run, channels={**run.channels, "x": y, "y": x})


def crossed(run: Run) -> Run:
    """The commands of the tail's offset and of the block's angle in each other's columns."""
    order = [list(COMMANDS).index(name) for name in COMMANDS]
    one, other = list(COMMANDS).index("tail_offset"), list(COMMANDS).index("block_angle")
    order[one], order[other] = other, one
    return replace(run, commands=CommandSteps(run.commands.times_s, run.commands.values[:, order]))


def mirrored(run: Run) -> Run:
    """Left and right exchanged."""
    names = [name for name in LEFT_HANDED if name in run.channels]
    return replace(run, channels={**run.channels, **{name: -run.channels[name] for name in names}})


def as_enu(run: Run) -> Run:
    """Everything in frame enu: z up, y and yaw to port, the tail's offset with them."""
    turned = {name: -values for name, values in run.channels.items()
              if name in ("z", "pitch", "q", "r", "v", "w")}  # fmt: skip
    channels = {**run.channels, **turned}
    if "x" in channels:
        channels |= {"x": run.channels["y"], "y": run.channels["x"]}
    if "yaw" in channels:
        channels["yaw"] = 0.5 * np.pi - run.channels["yaw"]
    return command("tail_offset", -1.0)(replace(run, channels=channels))


def times(samples: float, commands: float) -> Spoil:
    """Times of samples and of commands divided by factors, from the first sample on."""

    def spoil(run: Run) -> Run:
        begin = run.time_s[0]
        steps = run.commands
        return _again(
            run, begin + (run.time_s - begin) / samples,
            CommandSteps(begin + (steps.times_s - begin) / commands, steps.values),
        )  # fmt: skip

    return spoil


def late(offset: float) -> Spoil:
    """Commands logged so much later than they were given, s."""

    def spoil(run: Run) -> Run:
        steps = run.commands
        return _again(run, run.time_s, CommandSteps(steps.times_s + offset, steps.values))

    return spoil


def _again(run: Run, time_s: np.ndarray, steps: CommandSteps) -> Run:
    """The run with other times; rows that only a command had put there are gone."""
    kept = np.any([np.isfinite(a) for a in run.channels.values()], axis=0)
    channels = {name: a[kept] for name, a in run.channels.items()}
    return Run.from_steps(
        run.id, time_s[kept], channels, steps, start=run.start, tail_phase=run.tail_phase,
        condition=run.condition,
    )  # fmt: skip
