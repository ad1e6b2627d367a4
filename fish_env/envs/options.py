"""What a user asks of the environment beyond its settings: fish, water, sensors, delays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.validity import warn_far_outside
from fish_env.effects.extended import PREFIX, EffectValues, ExtendedModel, build_model
from fish_env.envs.config import EnvConfig, load_env_config
from fish_env.envs.config_checks import speed_range
from fish_env.envs.layout import SENSORS
from fish_env.envs.randomization import Randomization, build_randomization
from fish_env.envs.tasks import TASKS
from fish_env.errors import ConfigError
from fish_env.model.crank_slider import CrankSlider
from fish_env.model.state import INPUTS
from fish_env.params.io import as_fish
from fish_env.params.schema import FishParams
from fish_env.reading import is_number, shown

MOST_SUBSTEPS = 50
"""Parts into which a physics step is divided for an effect that is faster."""
NOISE_GROUPS = {
    "depth": ("depth",),
    "depth_rate": ("depth_rate",),
    "attitude": ("roll", "pitch"),
    "heading": ("heading",),
    "velocity": ("u", "v", "w"),
    "rates": ("p", "q", "r"),
}
"""Keys of ``observation_noise`` and the sensors they set; sensors may also be named one by one."""


@dataclass(frozen=True, eq=False)
class EnvOptions:
    """Everything that defines an environment, checked and ready.

    Attributes:
        config: settings.
        model: fish and effects.
        task: task name.
        goals: settings and draws -> goals.
        random: parameters drawn anew in each episode, or None.
        noise_sd: (sensors,) standard deviations, or None.
        action_lag: action delay in physics steps.
        observation_lag: observation delay in physics steps.
    """

    config: EnvConfig
    model: ExtendedModel
    task: str
    goals: Callable[[EnvConfig, FloatArray], dict[str, FloatArray]]
    random: Randomization | None
    noise_sd: FloatArray | None
    action_lag: int
    observation_lag: int


def env_options(
    task: str = "hold",
    fish: str | Path | FishParams = "zheng-2021-a",
    *,
    config: str | Path | Mapping[str, Any] | None = None,
    control_hz: float | None = None,
    physics_hz: float | None = None,
    cruise_speed: float | tuple[float, float] | None = None,
    effects: EffectValues | None = None,
    current: tuple[float, float, float] | None = None,
    wave: Mapping[str, float] | None = None,
    observation_noise: Mapping[str, float] | None = None,
    observation_delay_s: float = 0.0,
    action_delay_s: float = 0.0,
    randomization: str | Mapping[str, Any] | None = None,
    trust_effects: bool = False,
) -> EnvOptions:
    """Check and combine what the constructor of the environment takes (see its docstring).

    Raises:
        ConfigError: an unknown task or option, or values out of range.
        EffectError: an unknown effect, or one too fast for the physics step.
    """
    if not isinstance(task, str) or task not in TASKS:
        raise ConfigError(f"unknown task {shown(task)}: choose one of {', '.join(TASKS)}")
    if not isinstance(trust_effects, bool):
        raise ConfigError(f"trust_effects {shown(trust_effects)}: True or False")
    if not isinstance(fish, (str, Path, FishParams)):
        raise ConfigError(f"fish {shown(fish)}: a preset's name, a file, or parameters")
    settings = load_env_config(config, control_hz, physics_hz)
    if cruise_speed is not None:
        settings.tree["goal"]["cruise_speed"] = speed_range("cruise_speed", cruise_speed)
    loaded = as_fish(fish, trust_effects)
    drawn = _drawn_effects(randomization, loaded)
    model = build_model(loaded, _water(effects, current, wave), may_come_on=drawn)
    _check_effects({} if effects is None else effects, model)
    _check_reach(settings, loaded)
    ends = zip(settings.low.tolist(), settings.high.tolist(), strict=True)
    asked = dict(zip(INPUTS, ends, strict=True))
    warn_far_outside(loaded, asked, "narrow actuators in the settings (config)", stacklevel=3)
    random = build_randomization(randomization, loaded, model)
    settings = _resolving(settings, model, random)
    return EnvOptions(
        settings,
        model,
        task,
        TASKS[task],
        random,
        _noise(observation_noise),
        _lag("action_delay_s", action_delay_s, settings.dt),
        _lag("observation_delay_s", observation_delay_s, settings.dt),
    )


def _resolving(
    settings: EnvConfig, model: ExtendedModel, random: Randomization | None
) -> EnvConfig:
    """The settings with physics steps that the fastest effect allows.

    Raises:
        EffectError: it would take more than :data:`MOST_SUBSTEPS`.
    """
    parts = model.substeps(settings.dt)
    if random is not None:
        parts = max(parts, random.substeps(model, settings.dt))
    finer = settings.divided(min(parts, MOST_SUBSTEPS))
    model.check_step(finer.dt)
    if random is not None:
        random.check_step(model, finer.dt)
    return finer


def _water(
    effects: EffectValues | None,
    current: tuple[float, float, float] | None,
    wave: Mapping[str, float] | None,
) -> dict[str, Mapping[str, float]]:
    if effects is not None and not isinstance(effects, Mapping):
        raise ConfigError(f"effects {shown(effects)}: a mapping of names to parameters")
    combined: dict[str, Mapping[str, float]] = dict(effects or {})
    for name, value in (("current", current), ("wave", wave)):
        if value is not None and name in combined:
            raise ConfigError(f"{name} is given twice, as an option and in effects; drop one")
    if current is not None:
        triple = isinstance(current, (list, tuple, np.ndarray)) and len(current) == 3
        if not triple or not all(is_number(speed) for speed in current):
            raise ConfigError(f"current {shown(current)}: three speeds (north, east, down) in m/s")
        combined["current"] = dict(zip(("north", "east", "down"), map(float, current), strict=True))
    if wave is not None:
        if not isinstance(wave, Mapping) or not all(map(is_number, wave.values())):
            raise ConfigError(f"wave {shown(wave)}: a mapping like {{'amplitude': 0.05}} (m/s)")
        combined["wave"] = dict(wave)
    return combined


def _drawn_effects(spec: str | Mapping[str, Any] | None, fish: FishParams) -> set[str]:
    """Names of effects that may come on by a draw, so that the kernel needs them."""
    names: Iterable[Any] = spec if isinstance(spec, Mapping) else ()
    if isinstance(spec, str) and spec == "posterior" and fish.posterior is not None:
        names = fish.posterior.names
    drawn = (str(name) for name in names if str(name).startswith(PREFIX))
    return {name.removeprefix(PREFIX).partition(".")[0] for name in drawn}


def _check_effects(wanted: EffectValues, model: ExtendedModel) -> None:
    idle = [e.name for e in model.measurement if e.name in wanted and not e.acts_on_motion]
    if idle:
        raise ConfigError(
            f"effects {idle} change recordings, not the motion; for the observations of an agent "
            "use observation_noise and observation_delay_s"
        )


def _check_reach(settings: EnvConfig, fish: FishParams) -> None:
    crank = CrankSlider(fish.get("weight_block.crank.l1"), fish.get("weight_block.crank.l2"))
    low, high = crank.reach
    row = INPUTS.index("block_displacement")
    if settings.low[row] < low - 1e-9 or settings.high[row] > high + 1e-9:
        raise ConfigError(
            f"actuators.block_displacement {settings.low[row]:g} to {settings.high[row]:g} m is "
            f"beyond the crank's reach of {fish.name}: stay within {low:.4f} to {high:.4f} m"
        )


def _noise(spec: Mapping[str, float] | None) -> FloatArray | None:
    if spec is None:
        return None
    if not isinstance(spec, Mapping):
        raise ConfigError(f"observation_noise {shown(spec)}: a mapping of sensors to deviations")
    if not spec:
        return None
    sd = dict.fromkeys(SENSORS, 0.0)
    for name, value in spec.items():
        sensors = NOISE_GROUPS.get(name) or ((name,) if name in sd else ())
        if not sensors or not is_number(value) or value < 0:
            raise ConfigError(
                f"observation_noise {shown(name)}: {shown(value)}; give a standard deviation >= 0 "
                f"(SI) for any of {', '.join([*NOISE_GROUPS, *SENSORS])}"
            )
        sd |= dict.fromkeys(sensors, float(value))
    return np.array(list(sd.values()))


def _lag(name: str, delay_s: float, dt: float) -> int:
    if not is_number(delay_s) or not 0 <= delay_s <= 2.0:
        raise ConfigError(f"{name} = {shown(delay_s)} s: choose a delay between 0 and 2 s")
    steps = round(delay_s / dt)
    if abs(steps * dt - delay_s) > 1e-9:
        raise ConfigError(
            f"{name} = {delay_s} s is not a whole number of physics steps of {dt:g} s; "
            f"use {steps * dt:g} s or another physics rate"
        )
    return steps
