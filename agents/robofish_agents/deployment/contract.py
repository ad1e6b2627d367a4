"""The contract of an exported policy as JSON: order, units, rate, limits and history."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fish_env.envs.config import INPUTS, EnvConfig, load_env_config
from fish_env.envs.layout import MAX_BEAT_S, OBSERVATION, OBSERVATION_LIMIT
from fish_env.errors import ConfigError
from fish_env.files import write_text
from robofish_agents.policies.files import ACTIONS, PolicyFile

FORMAT = "robofish-contract-1"
UNITS = ("rad", "rad", "Hz", "m", "rad")
"""Of the actuators, in the order of INPUTS."""
POSITIVE = (
    "turns to port",
    "larger",
    "faster",
    "aft: nose up",
    "rolls to starboard",
)
"""What more of an actuator does, in the order of INPUTS."""
OF_TRAINING = ("actuators", "rates", "tank")
"""Groups of a training's settings that define what observations and actions mean."""
Settings = str | Path | Mapping[str, Any] | None


def contract_path(file: str | Path) -> Path:
    """Returns the path of the contract: that of the exported file with .json added."""
    return Path(f"{file}.json")


def environment_settings(policy: PolicyFile, settings: Settings = None) -> EnvConfig:
    """Reads the settings of the environment that a policy belongs to.

    Args:
        policy: the policy; its card holds what its training changed.
        settings: file or mapping to use in place of what the card says.

    Returns:
        The settings, with the control rate of the policy.

    Raises:
        ConfigError: the card names a file, or the control rate is not that of the policy.
    """
    config = load_env_config(_of_card(policy.card) if settings is None else settings)
    if abs(config.control_period - policy.history.period_s) > 1e-9:
        raise ConfigError(
            f"the policy acts every {policy.history.period_s:g} s, the environment's settings say "
            f"{config.control_period:g} s; give the settings it was trained with (--config)"
        )
    return config


def _of_card(card: Mapping[str, Any]) -> dict[str, Any]:
    trained = card.get("configuration")
    configuration = trained if isinstance(trained, Mapping) else {}
    environment = configuration.get("environment")
    options = dict(environment) if isinstance(environment, Mapping) else {}
    own = options.get("config", configuration.get("settings")) or {}
    if not isinstance(own, Mapping):
        raise ConfigError(
            "the policy was trained with an environment file; give that file (--config)"
        )
    tree = {key: own[key] for key in OF_TRAINING if key in own}
    rates = {"control": options.get("control_hz"), "physics": options.get("physics_hz")}
    given = {key: rate for key, rate in rates.items() if rate is not None}
    if given:
        own_rates = tree.get("rates")
        tree["rates"] = {**(own_rates if isinstance(own_rates, Mapping) else {}), **given}
    return tree


def make_contract(
    policy: PolicyFile, config: EnvConfig, interface: Mapping[str, Any]
) -> dict[str, Any]:
    """Makes the contract of an exported policy.

    Args:
        policy: the policy.
        config: settings of its environment.
        interface: how this export is called; stands under ``interface``.

    Returns:
        Plain values, ready for JSON.
    """
    history = policy.history
    return {
        "format": FORMAT,
        "made_with": f"robotic-fish {version('robotic-fish')}",
        "environment": policy.environment,
        "task": policy.task,
        "rate_hz": round(1.0 / history.period_s, 9),
        "frames": {
            "inertial": "x north, y east, z down (depth)",
            "body": "x forward, y starboard, z down",
            "heading": "0 north, positive to east (clockwise from above)",
        },
        "observation": {
            "size": len(OBSERVATION),
            "limit": OBSERVATION_LIMIT,
            "limit_means": "clip each to -limit..limit before it is handed over",
            "entries": _observations(config),
        },
        "action": {
            "size": ACTIONS,
            "low": -1.0,
            "high": 1.0,
            "target": "low + (action + 1) / 2 * (high - low) of the actuator",
            "at_rest": "the action of an actuator at zero: the last action before the first step",
            "entries": _actions(config),
        },
        "history": {
            "frames": history.frames,
            "low_pass_s": list(history.low_pass_s),
            "kept_inside": "the export stores past observations; give it one observation per step",
            "first": "before the first step, all past observations equal the first one",
        },
        "limits": {
            "shallowest_m": config.top,
            "deepest_m": config.bottom,
            "steepest_rad": float(config.tree["tumble_angle"]),
            "beyond": "the policy was not trained there; stop the tail",
        },
        "beat": {
            "longest_s": MAX_BEAT_S,
            "means": "averages over the last beat use 1 / tail frequency, at most this",
        },
        "interface": dict(interface),
    }


def _observations(config: EnvConfig) -> list[dict[str, Any]]:
    return [
        {"index": index, "name": name_of(text), "is": text, **_scale(text, scale, config)}
        for index, (text, scale) in enumerate(OBSERVATION)
    ]


def name_of(text: str) -> str:
    """Returns the name of an observation: its text before a bracket or comma, as an identifier."""
    return re.sub(r"\W+", "_", re.split(r"[(,]", text)[0].strip())


def _scale(text: str, scale: str, config: EnvConfig) -> dict[str, Any]:
    """Returns the subtrahend and the divisor of an observation, in a unit."""
    if scale == "half of the tank":
        half, middle = (config.bottom - config.top) / 2, (config.bottom + config.top) / 2
        return {"unit": "m", "subtract": middle, "divide_by": half}
    if scale == "action range":
        row = INPUTS.index(re.sub(r" now$", "", text).replace(" ", "_"))
        low, high = float(config.low[row]), float(config.high[row])
        return {"unit": UNITS[row], "subtract": (high + low) / 2, "divide_by": (high - low) / 2}
    number, _, unit = scale.partition(" ")
    return {"unit": unit or "1", "subtract": 0.0, "divide_by": float(number)}


def _actions(config: EnvConfig) -> list[dict[str, Any]]:
    rows = zip(
        INPUTS, UNITS, POSITIVE, *(v.tolist() for v in (config.low, config.high, config.slew)),
        strict=True,
    )  # fmt: skip
    return [
        {
            "index": index,
            "name": name,
            "unit": unit,
            "low": low,
            "high": high,
            "at_rest": -(high + low) / (high - low),
            "most_per_s": slew if slew < float("inf") else None,
            "more": positive,
        }
        for index, (name, unit, positive, low, high, slew) in enumerate(rows)
    ]


def write_contract(contract: Mapping[str, Any], file: str | Path, content: bytes) -> Path:
    """Writes the contract of an exported file beside it.

    Args:
        contract: from :func:`make_contract`.
        file: the exported file.
        content: what is in it; its checksum goes into the contract.

    Returns:
        Where the contract is.

    Raises:
        OutputError: it cannot be written.
    """
    path = contract_path(file)
    about = {"file": Path(file).name, "sha256": hashlib.sha256(content).hexdigest()}
    write_text(path, json.dumps({**contract, **about}, indent=1, allow_nan=False) + "\n")
    return path
