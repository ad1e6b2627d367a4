"""Training configurations, ``configs/train/*.yaml``: their keys, and reading them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from fish_env.envs.options import env_options
from fish_env.errors import ConfigError
from fish_env.params.io import config_root
from fish_env.reading import Unreadable, located
from fish_env.yaml_text import read_yaml
from robofish_agents.evaluation.suites import TRUST, environment_files, load_suite, suite_files
from robofish_agents.policies.history import HistorySpec
from robofish_agents.training.schema import build
from robofish_agents.training.settings import (
    Critic,
    Evaluation,
    History,
    Imitation,
    NetworkSettings,
    Ppo,
    Sac,
    Teaching,
    Threads,
    check,
)
from robofish_agents.training.settings import (
    LearningRate as LearningRate,
)

SCHEDULES = ("constant", "linear")
ENGINES = ("sb3", "rllib", "tensor")
DEFAULT_ENGINE = "sb3"
NOT_BY_FILE = "no file can say that it is trusted; remove the key and give --trust-effects"
MOST_FISH = 1000
"""Fish of one batch are seeded one after the other; a seed of a training leaves room for these."""


@dataclass(frozen=True)
class TrainConfig:
    """One training.

    Attributes:
        name: of the run folder.
        algorithm: ``ppo`` or ``sac``.
        total_steps: control steps of all fish together.
        task: ``hold`` or ``track``.
        seed: of networks, episodes and exploration.
        num_envs: fish side by side.
        disturbances: suites whose conditions (not episodes) are trained under; the fish are
            shared out evenly, and a name may stand there twice.
        environment: further keyword arguments of the environment; they replace those of the suite.
        settings: changes of the environment's settings (configs/env) that hold in training alone,
            such as sharper rewards or faster goals; evaluations go without.
        history: past observations that the policy sees.
        network: see :class:`NetworkSettings`.
        critic: see :class:`Critic`.
        teacher: see :class:`Teaching`.
        ppo: see :class:`Ppo`.
        sac: see :class:`Sac`.
        imitate: see :class:`Imitation`.
        normalise_reward: divide rewards by the running deviation of returns.
        evaluation: see :class:`Evaluation`.
        checkpoint_every: steps between two checkpoints.
        threads: see :class:`Threads`.
        engine: what learns: ``sb3`` (Stable-Baselines3), ``rllib`` (Ray), or ``tensor``
            (:mod:`robofish_agents.training.tensor_engine`).
        trust_effects: run the effect files that the fish's file names, see ``load_fish``; only a
            caller says so, never a file.
    """

    name: str
    algorithm: str
    task: str
    total_steps: int
    seed: int = 0
    num_envs: int = 64
    disturbances: tuple[str, ...] = ("calm",)
    environment: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    history: History = field(default_factory=History)
    network: NetworkSettings = field(default_factory=NetworkSettings)
    critic: Critic = field(default_factory=Critic)
    teacher: Teaching = field(default_factory=Teaching)
    ppo: Ppo = field(default_factory=Ppo)
    sac: Sac = field(default_factory=Sac)
    imitate: Imitation = field(default_factory=Imitation)
    normalise_reward: bool = True
    evaluation: Evaluation = field(default_factory=Evaluation)
    checkpoint_every: int = 100_000
    threads: Threads = field(default_factory=Threads)
    engine: str = DEFAULT_ENGINE
    trust_effects: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        """Refuses settings that contradict each other or the environment.

        Raises:
            ConfigError: says which.
        """
        check(self.algorithm in ("ppo", "sac"), "algorithm: ppo or sac")
        check(self.engine in ENGINES, f"engine: one of {', '.join(ENGINES)}")
        if self.engine == "rllib":
            self._check_rllib()
        if self.engine == "tensor":
            self._check_tensor()
        else:
            check(self.critic == Critic(), f"critic: engine {self.engine} has none of its own")
            check(self.teacher == Teaching(), f"teacher: engine {self.engine} has none")
            check(self.network.log_std_end is None, f"network.log_std_end: not with {self.engine}")
        check(0 <= self.seed < 1_000_000, "seed: 0 to 999999")
        check(1 <= self.num_envs <= MOST_FISH, f"num_envs: 1 to {MOST_FISH}")
        check(min(self.total_steps, self.checkpoint_every) > 0, "steps must be positive")
        rollout = self.ppo.n_steps * self.num_envs
        check(
            self.algorithm != "ppo" or rollout % self.ppo.batch_size == 0,
            f"ppo.batch_size must divide n_steps x num_envs, {rollout}",
        )
        for key, own in {"task": "task", "config": "settings"}.items():
            check(
                key not in self.environment or not getattr(self, own),
                f"environment.{key}: not together with '{own}'",
            )
        known = inspect.signature(env_options).parameters
        check(TRUST not in self.environment, f"environment.{TRUST}: {NOT_BY_FILE}")
        for key in self.environment:
            check(key in known, f"environment: unknown key '{key}'; known: {', '.join(known)}")
        check(self.algorithm == "ppo" or not self.imitate.rounds, "imitate: needs ppo")
        names = self.disturbances
        check(bool(names), "disturbances: at least one suite")
        check(self.num_envs % len(names) == 0, "num_envs: the same number for each disturbance")
        for name in names:
            checked = env_options(**self.options(name, training=True))
        self.history_spec(checked.config.control_period)

    def options(self, name: str, training: bool) -> dict[str, Any]:
        """Keyword arguments of the environment, with the settings of the training if asked for.

        Args:
            name: one of the disturbances.
            training: whether it is trained in.
        """
        suite = dict(load_suite(name).environment)
        options: dict[str, Any] = {"task": self.task} | suite | dict(self.environment)
        if training and self.settings:
            options["config"] = dict(self.settings)
        return options | {TRUST: self.trust_effects}

    def _check_rllib(self) -> None:
        """Refuses settings that RLlib's PPO does not have."""
        without = "engine rllib has no equal; {}, or train with --engine sb3"
        check(self.algorithm == "ppo", "algorithm: " + without.format("choose ppo"))
        check(self.ppo.target_kl is None, "ppo.target_kl: " + without.format("remove it"))
        check(not self.ppo.use_sde, "ppo.use_sde: " + without.format("remove it"))

    def _check_tensor(self) -> None:
        """Refuses settings that PPO over tensors does not have."""
        without = "engine tensor has no equal; {}, or train with --engine sb3"
        check(self.algorithm == "ppo", "algorithm: " + without.format("choose ppo"))
        check(not self.ppo.use_sde, "ppo.use_sde: " + without.format("remove it"))
        check(not self.imitate.rounds, "imitate: " + without.format("remove it"))
        taught = self.teacher.steps + self.teacher.distil_steps
        check(taught <= self.total_steps, "teacher: steps and distil_steps within total_steps")
        check(not taught or self.critic.privileged, "teacher: needs critic.privileged: true")

    def history_spec(self, period_s: float) -> HistorySpec:
        """Returns the past observations that the policy sees, for a control period (s)."""
        return HistorySpec(self.history.frames, self.history.low_pass_s, period_s)

    def tree(self) -> dict[str, Any]:
        """Returns the configuration as in a YAML file, with every default."""
        left_out = ["sac" if self.algorithm == "ppo" else "ppo", TRUST]
        if self.engine == DEFAULT_ENGINE:
            left_out.append("engine")  # configurations of before there was a choice stay the same
        if self.engine != "tensor":
            left_out += ["critic", "teacher"]
        tree = {key: value for key, value in asdict(self).items() if key not in left_out}
        if self.network.log_std_end is None:
            del tree["network"]["log_std_end"]  # for the same reason
        return dict(yaml.safe_load(yaml.safe_dump(_plain(tree))))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def load_train_config(
    name_or_path: str | Path, trust_effects: bool = False, **changes: Any
) -> TrainConfig:
    """Reads a configuration: a shipped one by its name, or any file by its path.

    Args:
        name_or_path: ``ppo-hold``, or a path.
        trust_effects: run the effect files that the fish's file names, see ``load_fish``.
        **changes: fields that replace those of the file; None leaves them.

    Raises:
        ConfigError: the file is missing, or a value in it is not valid; names file and key.
    """
    file = _find(name_or_path)
    try:
        tree = read_yaml(file)
    except Unreadable as error:
        raise ConfigError(f"{file}: {error}") from error
    if isinstance(tree, Mapping):
        tree = {"name": file.stem, **tree}
        if TRUST in tree:
            raise ConfigError(f"{file}: {TRUST}: {NOT_BY_FILE}")
        tree[TRUST] = trust_effects
        unused = {"ppo": "sac", "sac": "ppo"}.get(str(tree.get("algorithm")))
        if unused in tree:
            raise ConfigError(f"{file}: '{unused}' has no effect, the algorithm is another")
    config = build(TrainConfig, tree, str(file))
    given = {key: value for key, value in changes.items() if value is not None}
    return replace(config, **given)


def files_behind(name_or_path: str | Path, config: TrainConfig) -> list[Path]:
    """Lists the files that a training reads: its configuration, suites, fish and settings.

    Args:
        name_or_path: as for :func:`load_train_config`.
        config: what was read.
    """
    suites = [file for name in config.disturbances for file in suite_files(name)]
    return [_find(name_or_path), *suites, *environment_files(config.environment)]


def _find(name_or_path: str | Path) -> Path:
    folder = config_root() / "train"
    shipped = sorted(file.stem for file in folder.glob("*.yaml"))
    if str(name_or_path) in shipped:
        return folder / f"{name_or_path}.yaml"
    try:
        path = located(name_or_path)
    except Unreadable as error:
        raise ConfigError(f"{error}") from None
    if path.is_file():
        return path
    raise ConfigError(
        f"{name_or_path}: no such file, and no shipped training; there are: {', '.join(shipped)}"
    )
