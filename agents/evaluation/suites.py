"""Suites: frozen sets of episodes of the environment, read from configs/benchmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from fish_env.envs.tasks import TASKS
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from fish_env.params.io import config_root

RESERVED_SEEDS = range(1_000_000, 2_000_000)
"""Seeds of episodes that belong to the suites: nothing is trained, tuned or selected on them."""
FINGERPRINT_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Suite:
    """A frozen set of episodes, the same for both tasks.

    Attributes:
        name: short name.
        version: changed whenever the episodes change; numbers of two versions do not compare.
        summary: what is difficult about it.
        seed: episode i is seeded with seed + i.
        episodes: how many.
        episode_steps: control steps of each.
        environment: keyword arguments of the environment, beside the task.
        fingerprint: task -> sum over the first observations of all episodes.
    """

    name: str
    version: int
    summary: str
    seed: int
    episodes: int
    episode_steps: int
    environment: Mapping[str, Any]
    fingerprint: Mapping[str, float]

    def make(
        self, task: str, count: int | None = None, threads: int | None = None
    ) -> RoboticFish3DVectorEnv:
        """The environment of the suite, one fish for each of the first ``count`` episodes."""
        return RoboticFish3DVectorEnv(
            count or self.episodes,
            max_episode_steps=self.episode_steps,
            threads=threads,
            task=task,
            **self.environment,
        )

    def check(self, task: str) -> None:
        """Refuse to measure on episodes that are no longer those of the file.

        Raises:
            ConfigError: the environment now starts other episodes.
        """
        now = self.fingerprint_of(task)
        if abs(now - self.fingerprint[task]) > FINGERPRINT_TOLERANCE:
            raise ConfigError(
                f"suite {self.name} version {self.version}, task {task}: its episodes begin "
                f"otherwise than when it was frozen ({now:.6f}, not {self.fingerprint[task]:.6f}); "
                "use the release that it belongs to, or make a new version of the suite"
            )

    def fingerprint_of(self, task: str) -> float:
        """Sum over the first observations of all episodes, as they are now."""
        observations, _ = self.make(task).reset(seed=self.seed)
        return float(abs(observations.astype(float)).sum())


def suite_names() -> list[str]:
    """The suites that come with the package, from easy to hard as far as the names are known."""
    order = ("calm", "current", "noisy", "hard")
    found = {path.stem for path in (config_root() / "benchmarks").glob("*.yaml")}
    return [name for name in order if name in found] + sorted(found - set(order))


def load_suite(name_or_path: str | Path) -> Suite:
    """Reads a suite: a shipped one by its name, or any file by its path.

    Raises:
        ConfigError: there is none, or it lacks or misspells something.
    """
    named = str(name_or_path) in suite_names()
    path = config_root() / "benchmarks" / f"{name_or_path}.yaml" if named else Path(name_or_path)
    if not path.is_file():
        raise ConfigError(
            f"suite '{name_or_path}': neither one of {', '.join(suite_names())} nor a file"
        )
    try:
        tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not readable as YAML: {error}") from error
    return _checked(tree, path)


def _checked(tree: Any, path: Path) -> Suite:
    wanted = {field.name for field in fields(Suite)}
    if not isinstance(tree, dict) or set(tree) != wanted:
        given = set(tree) if isinstance(tree, dict) else set()
        raise ConfigError(
            f"{path}: a suite has exactly the keys {', '.join(sorted(wanted))}; "
            f"missing: {sorted(wanted - given)}, unknown: {sorted(given - wanted)}"
        )
    for key in ("version", "seed", "episodes", "episode_steps"):
        if not isinstance(tree[key], int) or tree[key] < 1:
            raise ConfigError(f"{path}: '{key}' must be a whole number from 1 up, got {tree[key]}")
    prints = tree["fingerprint"]
    if not isinstance(tree["environment"], dict) or set(prints or ()) != set(TASKS):
        raise ConfigError(
            f"{path}: 'environment' must be a mapping of options, 'fingerprint' one with a number "
            f"for each of {', '.join(TASKS)}"
        )
    return Suite(**tree)
