"""What settings of the environment must fulfil beyond their types, rule by rule."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.arrays import IntArray
from fish_env.errors import ConfigError
from fish_env.model.state import INPUTS
from fish_env.reading import is_number, shown

SLOWEST_PHYSICS_HZ = 10.0
FASTEST_PHYSICS_HZ, SLOWEST_CONTROL_HZ = 1e5, 0.01
Tree = dict[str, Any]
Rule = Iterator[tuple[bool, str]]
"""Pairs of a condition and what to say when it does not hold."""


def speed_range(name: str, value: Any) -> list[float]:
    """A speed or a range [low, high] as a range.

    Raises:
        ConfigError: not a number or two, negative, or the wrong way round.
    """
    speeds = list(value) if isinstance(value, (list, tuple)) else [value, value]
    if len(speeds) != 2 or not all(map(is_number, speeds)) or not 0 <= speeds[0] <= speeds[1]:
        raise ConfigError(f"{name} {shown(value)}: a speed >= 0 (m/s) or a range [low, high]")
    return [float(speed) for speed in speeds]


def elapsed_steps(value: npt.ArrayLike, count: int, most: int) -> IntArray:
    """Control steps that fish count as taken already, (count,).

    Args:
        value: what is given for it.
        count: number of fish.
        most: control steps of an episode.

    Raises:
        ConfigError: other numbers than whole ones from 0 to most - 1.
    """
    given = np.asarray(value)
    whole = given.dtype.kind in "iu" and given.shape == (count,)
    if not whole or given.min() < 0 or given.max() >= most:
        raise ConfigError(f"elapsed steps: {count} whole numbers from 0 to {most - 1}")
    return given.astype(np.int64)


def check_count(name: str, value: Any, most: int) -> None:
    """Refuses what is no whole number from 1 up.

    Args:
        name: of the option.
        value: given for it.
        most: largest value.

    Raises:
        ConfigError: not such a number.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not 1 <= value <= most:
        raise ConfigError(f"{name} {shown(value)}: a whole number, at least 1 and at most {most:,}")


def check_settings(tree: Tree, label: str) -> None:
    """Refuse settings that contradict each other.

    Raises:
        ConfigError: names the setting and what to change.
    """
    for rules in RULES:
        for holds, message in rules(tree):
            if not holds:
                raise ConfigError(f"{label}: {message}")


def rates(tree: Tree) -> Rule:
    """Physics runs at a whole multiple of the control rate, and fast enough."""
    control, physics = tree["rates"]["control"], tree["rates"]["physics"]
    yield 0 < control <= physics, "rates: 0 < control <= physics is needed"
    yield (
        physics >= SLOWEST_PHYSICS_HZ,
        f"rates: physics at {physics:g} Hz is too slow, use {SLOWEST_PHYSICS_HZ:g} Hz or more",
    )
    yield (
        physics <= FASTEST_PHYSICS_HZ and control >= SLOWEST_CONTROL_HZ,
        f"rates: at most {FASTEST_PHYSICS_HZ:g} Hz of physics, at least {SLOWEST_CONTROL_HZ:g} Hz "
        "of control",
    )
    substeps = round(physics / control)
    yield (
        abs(physics / control - substeps) < 1e-9,
        f"rates: physics ({physics:g} Hz) must be a whole multiple of control ({control:g} Hz); "
        f"use {substeps * control:g} Hz",
    )


def actuators(tree: Tree) -> Rule:
    """Ranges and slew limits of the actuators."""
    settings = tree["actuators"]
    for name in INPUTS:
        low, high, slew = (settings[name][key] for key in ("low", "high", "slew"))
        yield low < high, f"actuators.{name}: low must be below high"
        yield slew is None or slew > 0, f"actuators.{name}.slew: positive, or null for ideal"
    for name in ("tail_amplitude", "tail_frequency"):
        yield settings[name]["low"] >= 0, f"actuators.{name}.low: at least 0"


def tank(tree: Tree) -> Rule:
    """Depths and walls of the tank, and goals inside it."""
    depth, clearance, walls = (tree["tank"][key] for key in ("depth", "clearance", "walls"))
    yield 0 <= 2 * clearance < depth, "tank: twice the clearance exceeds depth"
    low, high = tree["goal"]["depth"]
    inside = clearance < low <= high < depth - clearance
    yield inside, "goal.depth: a range [low, high] inside the tank and its clearance"
    shape = walls is None or (isinstance(walls, list) and len(walls) == 4)
    yield (
        shape and (walls is None or (walls[0] < 0 < walls[1] and walls[2] < 0 < walls[3])),
        "tank.walls: [north_min, north_max, east_min, east_max] around the start at (0, 0)",
    )


def reward(tree: Tree) -> Rule:
    """Reward, success and the angle at which a fish has tumbled."""
    margins = [*tree["reward"]["margins"].values(), tree["reward"]["power_scale"]]
    yield min(margins) > 0, "reward: margins and power_scale must be positive"
    weights = tree["reward"]["weights"].values()
    yield min(weights) >= 0, "reward.weights: zero or positive; costs are subtracted"
    for task in ("path", "station"):
        own = tree["reward"][task]
        yield min(own.values()) >= 0, f"reward.{task}: zero or positive"
        yield own["margin"] > 0, f"reward.{task}.margin: positive"
    yield min(tree["success"].values()) >= 0, "success: zero or positive"
    yield 0 < tree["tumble_angle"] < np.pi, "tumble_angle: between 0 and pi"


def start(tree: Tree) -> Rule:
    """Where episodes start."""
    settings = tree["start"]
    for name in ("depth_offset", "heading_offset", "tilt"):
        yield settings[name] >= 0, f"start.{name}: the largest value, zero or positive"
    yield settings["surge"][0] <= settings["surge"][1], "start.surge: a range [low, high]"


def track(tree: Tree) -> Rule:
    """Signals of the task "track"."""
    for signal, settings in tree["goal"]["track"].items():
        for key, (low, high) in settings.items():
            yield 0 <= low <= high, f"goal.track.{signal}.{key}: a range [low, high] from 0 up"
    yield tree["goal"]["track"]["sine"]["period"][0] > 0, "goal.track.sine.period: positive"


def path(tree: Tree) -> Rule:
    """Shapes and guidance of the task "path"."""
    settings = tree["goal"]["path"]
    share = settings["share"].values()
    yield min(share) >= 0 < sum(share), "goal.path.share: zero or positive, and not all zero"
    for shape in ("helix", "waypoints", "figure"):
        for key, (low, high) in settings[shape].items():
            yield 0 <= low <= high, f"goal.path.{shape}.{key}: a range [low, high] from 0 up"
    for shape, key in (("helix", "radius"), ("helix", "turns"), ("figure", "radius")):
        yield settings[shape][key][0] > 0, f"goal.path.{shape}.{key}: positive"
    yield settings["waypoints"]["leg"][0] > 0, "goal.path.waypoints.leg: positive"
    guidance = settings["guidance"]
    yield guidance["lookahead"] > 0, "goal.path.guidance.lookahead: positive (m)"
    yield min(guidance.values()) >= 0, "goal.path.guidance: zero or positive"


def station(tree: Tree) -> Rule:
    """Places and guidance of the task "station"."""
    settings = tree["goal"]["station"]
    low, high = settings["distance"]
    yield 0 <= low <= high, "goal.station.distance: a range [low, high] from 0 up"
    yield settings["gain"] > 0, "goal.station.gain: positive (1/s)"
    yield settings["circle"] > 0, "goal.station.circle: positive (m)"
    yield settings["calm"] >= 0, "goal.station.calm: zero or positive (m/s)"


RULES: tuple[Callable[[Tree], Rule], ...] = (
    rates,
    actuators,
    tank,
    reward,
    start,
    track,
    path,
    station,
)
