"""Suites: frozen sets of episodes of the environment, read from configs/benchmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from fish_env.envs.tasks import TASKS
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from fish_env.params.io import config_root, fish_files
from fish_env.reading import Unreadable, is_number, located, shown
from fish_env.yaml_text import read_yaml

MOST = {"version": 10**9, "seed": 10**12, "episodes": 100_000, "episode_steps": 100_000}
RESERVED_SEEDS = range(1_000_000, 2_000_000)
"""Seeds of episodes that belong to the suites: nothing is trained, tuned or selected on them."""
ORDER = (
    "calm",
    "current",
    "noisy",
    "hard",
    "path/helix",
    "path/waypoints",
    "path/figure",
    "path/current",
    "station/current",
    "station/waves",
)
"""From easy to hard, for each kind of goal."""
FINGERPRINT_TOLERANCE = 1e-3
TRUST = "trust_effects"
"""Option of the environment that only a caller may give."""


@dataclass(frozen=True)
class Suite:
    """A frozen set of episodes, of one task or of several with the same starts.

    Attributes:
        name: short name.
        version: changes with the episodes; do not compare numbers of two versions.
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

    @property
    def tasks(self) -> list[str]:
        """Tasks of the suite."""
        return [task for task in TASKS if task in self.fingerprint]

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
        """Refuses a suite whose episodes are no longer those of the file.

        Raises:
            ConfigError: the environment now starts other episodes, or the suite has none of the
                task.
        """
        if task not in self.fingerprint:
            raise ConfigError(f"suite {self.name} is of task {', '.join(self.tasks)}, not {task}")
        now = self.fingerprint_of(task)
        if abs(now - self.fingerprint[task]) > FINGERPRINT_TOLERANCE:
            raise ConfigError(
                f"suite {self.name} version {self.version}, task {task}: its episodes differ "
                f"from the frozen ones ({now:.6f}, not {self.fingerprint[task]:.6f}); "
                "use the release that it belongs to, or make a new version of the suite"
            )

    def fingerprint_of(self, task: str) -> float:
        """Sum over the first observations of all episodes, as they are now."""
        observations, _ = self.make(task).reset(seed=self.seed)
        return float(abs(observations.astype(float)).sum())


def suite_names(*tasks: str) -> list[str]:
    """The suites that come with the package, in their order.

    Args:
        tasks: only those that have episodes of one of these; none: all.
    """
    folder = config_root() / "benchmarks"
    paths = (path.relative_to(folder).with_suffix("") for path in folder.rglob("*.yaml"))
    found = {path.as_posix() for path in paths}
    names = [name for name in ORDER if name in found] + sorted(found - set(ORDER))
    if not tasks:
        return names
    return [name for name in names if set(load_suite(name).tasks) & set(tasks)]


def load_suite(name_or_path: str | Path, trust_effects: bool = False) -> Suite:
    """Reads a suite: a shipped one by its name, or any file by its path.

    Args:
        name_or_path: a shipped suite's name, or a file.
        trust_effects: run the effect files that its fish's file names, see ``load_fish``.

    Raises:
        ConfigError: there is none, or it lacks or misspells something.
    """
    path = _find(name_or_path)
    try:
        tree = read_yaml(path)
    except Unreadable as error:
        raise ConfigError(f"{path}: {error}") from error
    suite = _checked(tree, path)
    if not trust_effects:
        return suite
    return replace(suite, environment={**suite.environment, TRUST: True})


def suite_files(name_or_path: str | Path) -> list[Path]:
    """The files that a suite is read from, those of its fish and settings among them.

    Raises:
        RoboticFishError: one of them is missing or cannot be read.
    """
    return [_find(name_or_path), *environment_files(load_suite(name_or_path).environment)]


def environment_files(options: Mapping[str, Any]) -> list[Path]:
    """The files that the environment reads for its options.

    Raises:
        ParameterError: there is no such fish.
    """
    settings, fish = options.get("config"), options.get("fish")
    found = [Path(settings)] if isinstance(settings, (str, Path)) else []
    return found if fish is None else [*found, *fish_files(fish)]


def _find(name_or_path: str | Path) -> Path:
    named = str(name_or_path) in suite_names()
    try:
        path = config_root() / "benchmarks" / f"{name_or_path}.yaml"
        path = path if named else located(name_or_path)
    except Unreadable as error:
        raise ConfigError(f"{error}") from None
    if not path.is_file():
        known = ", ".join(suite_names())
        raise ConfigError(f"suite {shown(str(name_or_path))}: neither one of {known} nor a file")
    return path


def _checked(tree: Any, path: Path) -> Suite:
    wanted = {field.name for field in fields(Suite)}
    if not isinstance(tree, dict) or set(tree) != wanted:
        given = set(tree) if isinstance(tree, dict) else set()
        unknown = shown(sorted(map(str, given - wanted)))
        raise ConfigError(
            f"{path}: a suite has exactly the keys {', '.join(sorted(wanted))}; "
            f"missing: {sorted(wanted - given)}, unknown: {unknown}"
        )
    for key in ("version", "seed", "episodes", "episode_steps"):
        if type(tree[key]) is not int or not 1 <= tree[key] <= MOST[key]:
            raise ConfigError(
                f"{path}: '{key}' must be a whole number from 1 to {MOST[key]:,}, "
                f"got {shown(tree[key])}"
            )
    for key in ("name", "summary"):
        if not isinstance(tree[key], str) or not tree[key].isprintable():
            raise ConfigError(f"{path}: '{key}' must be a text on one line")
    prints = tree["fingerprint"]
    whole = isinstance(prints, dict) and bool(prints) and set(prints) <= set(TASKS)
    if not isinstance(tree["environment"], dict) or not (
        whole and all(map(is_number, prints.values()))
    ):
        raise ConfigError(
            f"{path}: 'environment' must be a mapping of options, 'fingerprint' one with a number "
            f"for each of its tasks, of {', '.join(TASKS)}"
        )
    if TRUST in tree["environment"]:
        raise ConfigError(
            f"{path}: environment.{TRUST}: no file can say that it is trusted; remove the key and "
            "give the option --trust-effects"
        )
    return Suite(**tree)
