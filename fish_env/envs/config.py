"""Settings of the environment: read from YAML, checked, and packed for the compiled step."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config_checks import check_settings, speed_range
from fish_env.envs.layout import Setup, empty_setup
from fish_env.errors import ConfigError
from fish_env.model.state import INPUTS as INPUTS  # open to what builds on environments
from fish_env.params.io import config_root
from fish_env.reading import Unreadable, is_number, located, printable, short, shown
from fish_env.yaml_text import read_yaml

DEFAULT_NAME = "robotic-fish-3d.yaml"
OWN_WEIGHTS = {
    "depth": Setup.WEIGHT_DEPTH,
    "heading": Setup.WEIGHT_HEADING,
    "speed": Setup.WEIGHT_SPEED,
    "place": Setup.WEIGHT_PLACE,
    "margin": Setup.MARGIN_PLACE,
}
"""What the settings say under ``reward.<task>``, and where the compiled step finds it."""


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

    def divided(self, parts: int) -> EnvConfig:
        """The same settings with every physics step divided into so many."""
        return replace(self, dt=self.dt / parts, substeps=self.substeps * parts)

    def setup(self, task: str = "hold") -> FloatArray:
        """The numbers that the compiled step shares between all fish (see layout.Setup).

        Args:
            task: its own weights of goals hold, where the settings have some.
        """
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
        names: tuple[str, ...] = ("depth", "heading", "speed", "power", "action")
        array[Setup.WEIGHT_DEPTH : Setup.WEIGHT_ACTION + 1] = [weights[n] for n in names]
        array[Setup.WEIGHT_WITHIN] = weights["within"]
        array[Setup.MARGIN_DEPTH : Setup.MARGIN_SPEED + 1] = [margins[n] for n in names[:3]]
        array[Setup.POWER_SCALE] = tree["reward"]["power_scale"]
        limits = ("depth", "heading", "speed", "speed_floor", "time")
        array[Setup.TOLERANCE_DEPTH : Setup.SUCCESS_TIME + 1] = [success[n] for n in limits]
        array[Setup.TOLERANCE_CROSS_TRACK] = success["cross_track"]
        array[Setup.TOLERANCE_PLACE] = success["place"]
        guidance, station = tree["goal"]["path"]["guidance"], tree["goal"]["station"]
        names = ("lookahead", "integral", "corner")
        array[Setup.LOOKAHEAD : Setup.CORNER + 1] = [guidance[name] for name in names]
        names = ("gain", "circle", "calm")
        array[Setup.STATION_GAIN : Setup.STATION_CALM + 1] = [station[name] for name in names]
        array[Setup.MARGIN_PLACE] = 1.0
        own = tree["reward"].get(task, {})
        for name in own:
            array[OWN_WEIGHTS[name]] = own[name]
        return array


@cache
def _default_tree() -> dict[str, Any]:
    return dict(read_yaml(config_root() / "env" / DEFAULT_NAME))


def _read(path: Path) -> Mapping[str, Any]:
    try:
        tree = read_yaml(located(path))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; give the path of a YAML file") from None
    except Unreadable as error:
        raise ConfigError(f"{path}: {error}") from error
    if not isinstance(tree, Mapping):
        raise ConfigError(f"{path}: must be a mapping like {DEFAULT_NAME}")
    return tree


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
        source = _read(Path(source))
    if source is not None and not isinstance(source, Mapping):
        raise ConfigError(f"config {shown(source)}: give the path of a YAML file or a mapping")
    _merge(tree, source or {}, label, "")
    rates = {"control": control_hz, "physics": physics_hz}
    given = {key: value for key, value in rates.items() if value is not None}
    for key, value in given.items():
        # The file that `source` names has no part in it.
        if not (is_number(value) and value > 0.0):
            raise ConfigError(f"{key}_hz {shown(value)}: a number above 0 (Hz)")
    _merge(tree["rates"], given, label, "rates.")
    return _check(tree, label)


def _merge(into: dict[str, Any], changes: Mapping[str, Any], label: str, prefix: str) -> None:
    for key, value in changes.items():
        path = f"{prefix}{key}"
        if key not in into:
            raise ConfigError(
                f"{label}: unknown key '{short(printable(path))}'; known here: {', '.join(into)}"
            )
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
        if not is_number(item):
            raise ConfigError(f"{label}: '{path}' must be a finite number, got {shown(item)}")
    if isinstance(default, list) and len(items) != len(default):
        raise ConfigError(f"{label}: '{path}' must have {len(default)} numbers, got {shown(value)}")
    return list(value) if isinstance(value, (list, tuple)) and ranges else value


def _check(tree: dict[str, Any], label: str) -> EnvConfig:
    check_settings(tree, label)
    goal = tree["goal"]
    goal["cruise_speed"] = speed_range(f"{label}: goal.cruise_speed", goal["cruise_speed"])
    actuators = [tree["actuators"][name] for name in INPUTS]
    slew = [np.inf if a["slew"] is None else float(a["slew"]) for a in actuators]
    return EnvConfig(
        tree,
        np.array([a["low"] for a in actuators], float),
        np.array([a["high"] for a in actuators], float),
        np.array(slew),
        1.0 / tree["rates"]["physics"],
        round(tree["rates"]["physics"] / tree["rates"]["control"]),
    )
