"""The trainings of a sweep."""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fish_env.errors import ConfigError
from fish_env.files import file_name
from fish_env.reading import Unreadable, shown
from fish_env.yaml_text import parse_yaml
from robofish_agents.evaluation.suites import TRUST
from robofish_agents.training.config import TrainConfig, load_train_config
from robofish_agents.training.schema import build

MOST_TRIALS = 10_000
LONGEST_NAME = 120
_RANGE = re.compile(r"(\d{1,6})-(\d{1,6})")


@dataclass(frozen=True)
class Trial:
    """One training of a sweep.

    Attributes:
        name: of its run folder.
        config: what is trained.
        changes: key -> value that replaces that of the configuration.
    """

    name: str
    config: TrainConfig
    changes: Mapping[str, Any]


def plan(
    source: str | Path,
    seeds: str = "",
    settings: Sequence[str] = (),
    steps: int | None = None,
    trust_effects: bool = False,
) -> list[Trial]:
    """Returns all combinations of seeds and values.

    Args:
        source: a configuration, as for :func:`robofish_agents.training.config.load_train_config`.
        seeds: ``0,1,2`` or ``0-9``; default: the configuration's own.
        settings: ``key=a,b,c`` each, keys with dots for what lies deeper, values as in YAML.
        steps: another number of steps.
        trust_effects: run the effect files that the fish's file names.

    Raises:
        ConfigError: a key, value or seed is not valid; names it.
    """
    base = load_train_config(source, trust_effects, total_steps=steps)
    chosen = _seeds(seeds) if seeds else [base.seed]
    axes = dict(map(_axis, settings))
    if len(axes) < len(settings):
        raise ConfigError("--set: a key is given twice; put all its values into one --set")
    combinations = list(itertools.product(*axes.values()))
    if len(combinations) * len(chosen) > MOST_TRIALS:
        raise ConfigError(f"a sweep of more than {MOST_TRIALS} trainings; give fewer values")
    tree = base.tree()
    trials = [
        _trial(tree, dict(zip(axes, values, strict=True)), seed, trust_effects)
        for values in combinations
        for seed in chosen
    ]
    names = [trial.name for trial in trials]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"--set, --seeds: {name} would be trained twice; drop a value")
    return trials


def _trial(tree: dict[str, Any], changes: dict[str, Any], seed: int, trust: bool) -> Trial:
    changed = copy.deepcopy(tree)
    for key, value in changes.items():
        _put(changed, key, value)
    words = ", ".join(f"{key}={shown(value)}" for key, value in changes.items())
    config = build(TrainConfig, changed | {"seed": seed, TRUST: trust}, f"--set {words}")
    values = [f"{key}={_short(value)}" for key, value in changes.items()]
    name = file_name("-".join([config.name, *values, f"seed-{seed}"]))
    if len(name) > LONGEST_NAME:
        name = f"{name[:LONGEST_NAME]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return Trial(name, config, changes)


def _put(tree: dict[str, Any], key: str, value: Any) -> None:
    *above, last = key.split(".")
    node = tree
    for part in above:
        node = node.setdefault(part, {})
        if not isinstance(node, dict):
            raise ConfigError(f"--set {key}: '{part}' has nothing below it; correct the key")
    node[last] = value


def _short(value: Any) -> str:
    return json.dumps(value, separators=(",", ":")).replace('"', "")


def _axis(text: str) -> tuple[str, list[Any]]:
    key, equals, values = text.partition("=")
    key = key.strip()
    if not equals or not key:
        raise ConfigError(f"--set {shown(text)}: write KEY=VALUE,VALUE,...")
    if key in ("seed", "name", TRUST):
        raise ConfigError(f"--set {key}: not a setting of a sweep; for seeds there is --seeds")
    try:
        parsed = parse_yaml(f"[{values}]")
    except Unreadable as error:
        raise ConfigError(f"--set {key}: {error}") from None
    if not isinstance(parsed, list) or not parsed or None in parsed:
        raise ConfigError(f"--set {key}: write its values with commas between, {key}=1,2")
    return key, parsed


def _seeds(text: str) -> list[int]:
    found: list[int] = []
    for part in text.split(","):
        word = part.strip()
        span = _RANGE.fullmatch(word)
        if span:
            found += range(int(span[1]), int(span[2]) + 1)
        elif word.isascii() and word.isdigit() and len(word) <= 6:
            found.append(int(word))
        else:
            raise ConfigError(f"--seeds {shown(text)}: write 0,1,2 or 0-9")
    if not found:
        raise ConfigError(f"--seeds {shown(text)}: a span from the smaller to the larger number")
    return found
