"""What is compared, declared in a file before anything is run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from fish_env.envs.tasks import SIGNAL_TASKS
from fish_env.errors import ConfigError
from fish_env.params.io import merged
from robofish_agents.evaluation.metrics import METRICS
from robofish_agents.evaluation.suites import Suite, load_suite
from robofish_agents.training.config import TrainConfig, load_train_config
from robofish_agents.training.schema import build
from tests.hidden.cases import NOMINAL
from tests.hidden.plans import PLANS
from tests.hidden.sizes import SIZES

DECLARED = Path(__file__).with_name("measure-to-policy.yaml")


@dataclass(frozen=True)
class HiddenFish:
    """A fish that differs from the printed one in ways that are not disclosed.

    Attributes:
        name: short name.
        seed: of its coefficients, the exact sizes of its effects, and all noise of its runs.
        effects: size of each effect, 1 is typical.
    """

    name: str
    seed: int
    effects: Mapping[str, float]


@dataclass(frozen=True)
class Declaration:
    """A comparison.

    Attributes:
        printed: the fish that the designer knows.
        fish: the hidden ones.
        tier: how they are measured, a tier of the hidden-effect suite.
        recipe: how policies are trained, on whichever fish.
        seeds: of the trainings.
        spread: parameters of the fish around the printed one, each with its spread.
        suite: whose episodes the policies are judged on.
        tasks: the first is what the comparison is about.
        metrics: as for tasks.
    """

    printed: str
    fish: tuple[HiddenFish, ...]
    tier: str
    recipe: TrainConfig
    seeds: tuple[int, ...]
    spread: Mapping[str, Any]
    suite: Suite
    tasks: tuple[str, ...]
    metrics: tuple[str, ...]


def load_declaration(file: Path = DECLARED) -> Declaration:
    """Reads a declaration.

    Raises:
        ConfigError: a key is missing or unknown, or names something that there is not.
    """
    tree = yaml.safe_load(file.read_text(encoding="utf-8"))
    wanted = {field.name for field in fields(Declaration)} - {"recipe"} | {"training"}
    if set(tree) != wanted:
        raise ConfigError(f"{file}: wrong or missing keys: {sorted(set(tree) ^ wanted)}")
    _check(file, "tier", [tree["tier"]], PLANS)
    _check(file, "tasks", tree["tasks"], SIGNAL_TASKS)
    _check(file, "metrics", tree["metrics"], METRICS)
    return Declaration(
        tree["printed"],
        tuple(_hidden(file, name, entry, tree["printed"]) for name, entry in tree["fish"].items()),
        tree["tier"],
        _recipe(file, **tree["training"]),
        tuple(tree["seeds"]),
        load_suite(tree["spread"]).environment["randomization"],
        load_suite(tree["suite"]),
        tuple(tree["tasks"]),
        tuple(tree["metrics"]),
    )


def _check(file: Path, key: str, names: list[str], known: Any) -> None:
    for name in names:
        if name not in known:
            raise ConfigError(f"{file}: {key}: '{name}' is none of {', '.join(known)}")


def _hidden(file: Path, name: str, entry: Mapping[str, Any], printed: str) -> HiddenFish:
    fish = HiddenFish(name, **entry)
    _check(file, f"fish.{name}.effects", list(fish.effects), SIZES)
    nominal = NOMINAL[fish.seed % len(NOMINAL)]
    if nominal != printed:
        raise ConfigError(f"{file}: fish.{name}: seed {fish.seed} is for {nominal}, not {printed}")
    return fish


def _recipe(file: Path, recipe: str, changes: Mapping[str, Any]) -> TrainConfig:
    tree = merged(load_train_config(recipe).tree(), {**changes, "name": file.stem})
    config: TrainConfig = build(TrainConfig, tree, str(file))
    return config
