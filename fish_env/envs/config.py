"""Settings of the environment: read from YAML, checked, and packed for the compiled step."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from fish_env.envs.layout import Setup, empty_setup
from fish_env.errors import ConfigError
from fish_env.model.state import INPUTS
from fish_env.params.io import config_root

FloatArray = npt.NDArray[np.float64]
DEFAULT_NAME = "robotic-fish-3d.yaml"


@dataclass(frozen=True)
class EnvConfig:
    """Checked settings; ``tree`` mirrors configs/env/robotic-fish-3d.yaml.

    Attributes:
        tree: nested settings.
        low: (5,) physical value of action -1, in the order of INPUTS.
        high: (5,) physical value of action +1.
        slew: (5,) largest rate per second, infinite where the actuator is ideal.
        dt: physics step (s).
        substeps: physics steps in a control step.
    """

    tree: Mapping[str, Any]
    low: FloatArray
    high: FloatArray
    slew: FloatArray
    dt: float
    substeps: int

    @property
    def control_period(self) -> float:
        """Seconds between two actions."""
        return self.dt * self.substeps

    @property
    def top(self) -> float:
        """Shallowest depth allowed (m)."""
        return float(self.tree["tank"]["clearance"])

    @property
    def bottom(self) -> float:
        """Deepest depth allowed (m)."""
        return float(self.tree["tank"]["depth"]) - self.top

    def setup(self) -> FloatArray:
        """The numbers that the compiled step shares between all fish (see layout.Setup)."""
        tree, array = self.tree, empty_setup()
        weights, margins, success = (
            tree["reward"]["weights"],
            tree["reward"]["margins"],
            tree["success"],
        )
        walls = tree["tank"]["walls"] or (-np.inf, np.inf, -np.inf, np.inf)
        array[Setup.DT] = self.dt
        array[Setup.CENTRE : Setup.CENTRE + 5] = (self.low + self.high) / 2
        array[Setup.HALF_RANGE : Setup.HALF_RANGE + 5] = (self.high - self.low) / 2
        array[Setup.TOP], array[Setup.BOTTOM] = self.top, self.bottom
        array[Setup.NORTH_MIN : Setup.EAST_MAX + 1] = walls
        array[Setup.TUMBLE_COSINE] = np.cos(tree["tumble_angle"])
        names = ("depth", "heading", "speed", "power", "action")
        array[Setup.WEIGHT_DEPTH : Setup.WEIGHT_ACTION + 1] = [weights[n] for n in names]
        array[Setup.MARGIN_DEPTH : Setup.MARGIN_SPEED + 1] = [margins[n] for n in names[:3]]
        array[Setup.POWER_SCALE] = tree["reward"]["power_scale"]
        limits = ("depth", "heading", "speed", "speed_floor", "time")
        array[Setup.TOLERANCE_DEPTH : Setup.SUCCESS_TIME + 1] = [success[n] for n in limits]
        return array


@cache
def _default_tree() -> dict[str, Any]:
    return dict(yaml.safe_load((config_root() / "env" / DEFAULT_NAME).read_text()))


def load_env_config(
    source: str | Path | Mapping[str, Any] | None = None,
    control_hz: float | None = None,
    physics_hz: float | None = None,
) -> EnvConfig:
    """Read settings: the defaults, changed by a file or mapping, then by the two rates.

    Raises:
        ConfigError: an unknown key, a wrong type, or values that contradict each other.
    """
    tree = deepcopy(_default_tree())
    label = "environment settings"
    if isinstance(source, (str, Path)):
        label = str(source)
        path = Path(source)
        if not path.is_file():
            raise ConfigError(f"{label}: no such file; give the path of a YAML file")
        source = yaml.safe_load(path.read_text())
        if not isinstance(source, Mapping):
            raise ConfigError(f"{label}: must be a mapping like {DEFAULT_NAME}")
    _merge(tree, source or {}, label, "")
    for key, value in (("control", control_hz), ("physics", physics_hz)):
        if value is not None:
            tree["rates"][key] = float(value)
    return _check(tree, label)


def _merge(into: dict[str, Any], changes: Mapping[str, Any], label: str, prefix: str) -> None:
    for key, value in changes.items():
        path = f"{prefix}{key}"
        if key not in into:
            raise ConfigError(f"{label}: unknown key '{path}'; known here: {', '.join(into)}")
        if isinstance(into[key], dict):
            if not isinstance(value, Mapping):
                raise ConfigError(
                    f"{label}: '{path}' must be a mapping with {', '.join(into[key])}"
                )
            _merge(into[key], value, label, f"{path}.")
        else:
            into[key] = _number_like(value, into[key], label, path)


def _number_like(value: Any, default: Any, label: str, path: str) -> Any:
    optional = path == "tank.walls" or path.endswith(".slew")
    if value is None and optional:
        return None
    ranges = isinstance(default, list) or path in ("tank.walls", "goal.cruise_speed")
    items = value if isinstance(value, (list, tuple)) and ranges else [value]
    for item in items:
        if isinstance(item, bool) or not isinstance(item, (int, float)) or not np.isfinite(item):
            raise ConfigError(f"{label}: '{path}' must be a finite number, got {item!r}")
    if isinstance(default, list) and len(items) != len(default):
        raise ConfigError(f"{label}: '{path}' must have {len(default)} numbers, got {value!r}")
    return list(value) if isinstance(value, (list, tuple)) and ranges else value


def _check(tree: dict[str, Any], label: str) -> EnvConfig:
    def require(condition: bool, message: str) -> None:
        if not condition:
            raise ConfigError(f"{label}: {message}")

    control, physics = tree["rates"]["control"], tree["rates"]["physics"]
    require(0 < control <= physics, "rates: 0 < control <= physics is needed")
    substeps = round(physics / control)
    require(
        abs(physics / control - substeps) < 1e-9,
        f"rates: physics ({physics:g} Hz) must be a whole multiple of control ({control:g} Hz); "
        f"use {substeps * control:g} Hz",
    )
    actuators = [tree["actuators"][name] for name in INPUTS]
    for name, actuator in zip(INPUTS, actuators, strict=True):
        require(actuator["low"] < actuator["high"], f"actuators.{name}: low must be below high")
        slew = actuator["slew"]
        require(slew is None or slew > 0, f"actuators.{name}.slew: positive, or null for ideal")
    require(
        tree["actuators"]["tail_amplitude"]["low"] >= 0, "actuators.tail_amplitude.low: at least 0"
    )
    require(
        tree["actuators"]["tail_frequency"]["low"] >= 0, "actuators.tail_frequency.low: at least 0"
    )
    tank = tree["tank"]
    require(0 <= 2 * tank["clearance"] < tank["depth"], "tank: twice the clearance exceeds depth")
    low, high = tree["goal"]["depth"]
    inside = tank["clearance"] < low <= high < tank["depth"] - tank["clearance"]
    require(inside, "goal.depth: a range [low, high] inside the tank and its clearance")
    walls = tank["walls"]
    if walls is not None:
        shape = isinstance(walls, list) and len(walls) == 4
        require(
            shape and walls[0] < 0 < walls[1] and walls[2] < 0 < walls[3],
            "tank.walls: [north_min, north_max, east_min, east_max] around the start at (0, 0)",
        )
    margins = [*tree["reward"]["margins"].values(), tree["reward"]["power_scale"]]
    require(all(value > 0 for value in margins), "reward: margins and power_scale must be positive")
    require(
        all(value >= 0 for value in tree["reward"]["weights"].values()),
        "reward.weights: zero or positive; costs are subtracted",
    )
    slew = [np.inf if a["slew"] is None else float(a["slew"]) for a in actuators]
    return EnvConfig(
        tree,
        np.array([a["low"] for a in actuators], float),
        np.array([a["high"] for a in actuators], float),
        np.array(slew),
        1.0 / physics,
        substeps,
    )
