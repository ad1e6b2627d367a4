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
from fish_env.reading import Unreadable, is_number, located, read_yaml
from robofish_agents.evaluation.suites import TRUST, environment_files, load_suite, suite_files
from robofish_agents.policies.files import ACTIONS
from robofish_agents.policies.history import HistorySpec
from robofish_agents.policies.network import ACTIVATIONS
from robofish_agents.training.schema import build
from robofish_agents.training.teacher_gains import TEACHER_GAIN_NAMES

SCHEDULES = ("constant", "linear")
ENGINES = ("sb3", "rllib", "tensor")
DEFAULT_ENGINE = "sb3"
NOT_BY_FILE = "no file can say that it is trusted; remove the key and give --trust-effects"
MOST_FISH = 1000
"""Fish of one batch are seeded one after the other; a seed of a training leaves room for these."""


def _check(holds: bool, message: str) -> None:
    if not holds:
        raise ConfigError(message)


@dataclass(frozen=True)
class History:
    """Past observations that the policy sees; :class:`robofish_agents.policies.HistorySpec`."""

    frames: int = 1
    low_pass_s: tuple[float, ...] = ()


@dataclass(frozen=True)
class NetworkSettings:
    """The perceptrons, one for actions and one for values.

    Attributes:
        layers: widths of the hidden layers.
        activation: ``tanh`` or ``relu``.
        log_std_init: logarithm of the first standard deviation of actions (PPO).
        first_action: mean action before anything is learnt (PPO); zeros if empty.
    """

    layers: tuple[int, ...] = (64, 64)
    activation: str = "tanh"
    log_std_init: float = -0.5
    first_action: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _check(bool(self.layers) and min(self.layers) > 0, "network.layers: positive widths")
        names = ", ".join(ACTIVATIONS)
        _check(self.activation in ACTIVATIONS, f"network.activation: one of {names}")
        first = self.first_action
        _check(
            not first or (len(first) == ACTIONS and max(map(abs, first)) <= 1.0),
            f"network.first_action: {ACTIONS} numbers from -1 to 1",
        )


@dataclass(frozen=True)
class Critic:
    """The network of values (engine ``tensor``), which a policy file does not hold.

    Attributes:
        privileged: it sees the true state, the parameters of the fish and the future of the goal
            instead of the inputs of the policy.
        layers: widths of its hidden layers; empty: those of ``network``.
    """

    privileged: bool = False
    layers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        _check(min(self.layers, default=1) > 0, "critic.layers: positive widths")


@dataclass(frozen=True)
class LearningRate:
    """Step size of Adam: constant, or falling in a straight line from ``start`` to ``end``."""

    start: float = 3e-4
    end: float | None = None

    def __post_init__(self) -> None:
        _check(self.start > 0, "learning_rate.start must be positive")
        _check(self.end is None or self.end >= 0, "learning_rate.end must not be negative")


@dataclass(frozen=True)
class Teaching:
    """A teacher that sees the true state and learns by PPO, before the policy (engine ``tensor``).

    Attributes:
        steps: control steps in which the teacher learns, of ``total_steps``; 0: none.
        distil_steps: control steps after them in which the policy is fitted to the teacher.
        layers: widths of the teacher's hidden layers.
        log_std_init: logarithm of its first standard deviation of actions.
        log_std_end: an upper limit of that logarithm falls to it in a straight line; None: none.
        learning_rate: of its PPO.
        distil_rate: of the fit.
        distil_epochs: passes of the fit through each rollout.
    """

    steps: int = 0
    distil_steps: int = 0
    layers: tuple[int, ...] = (64, 64)
    log_std_init: float = -0.5
    log_std_end: float | None = None
    learning_rate: LearningRate = field(default_factory=LearningRate)
    distil_rate: LearningRate = field(default_factory=LearningRate)
    distil_epochs: int = 4

    def __post_init__(self) -> None:
        _check(min(self.steps, self.distil_steps) >= 0, "teacher: steps, distil_steps >= 0")
        _check(self.distil_steps == 0 or self.steps > 0, "teacher.distil_steps: needs steps")
        _check(bool(self.layers) and min(self.layers) > 0, "teacher.layers: positive widths")
        _check(self.distil_epochs > 0, "teacher.distil_epochs: positive")
        end = self.log_std_init if self.log_std_end is None else self.log_std_end
        _check(end <= self.log_std_init, "teacher.log_std_end: at most log_std_init")


@dataclass(frozen=True)
class Ppo:
    """Proximal policy optimisation, Schulman et al. 2017; names as in Stable-Baselines3."""

    n_steps: int = 64
    batch_size: int = 1024
    n_epochs: int = 6
    learning_rate: LearningRate = field(default_factory=LearningRate)
    gamma: float = 0.98
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    target_kl: float | None = None
    use_sde: bool = False
    sde_sample_freq: int = -1

    def __post_init__(self) -> None:
        positive = (self.n_steps, self.batch_size, self.n_epochs, self.clip_range)
        _check(min(positive) > 0, "ppo: n_steps, batch_size, n_epochs, clip_range are positive")
        _check(0 < self.gamma <= 1 and 0 <= self.gae_lambda <= 1, "ppo: gamma, gae_lambda in 0..1")


@dataclass(frozen=True)
class Sac:
    """Soft actor-critic, Haarnoja et al. 2018; names as in Stable-Baselines3."""

    buffer_size: int = 200_000
    batch_size: int = 256
    train_freq: int = 1
    gradient_steps: int = 8
    learning_starts: int = 5_000
    learning_rate: LearningRate = field(default_factory=LearningRate)
    gamma: float = 0.98
    tau: float = 0.01

    def __post_init__(self) -> None:
        positive = (self.buffer_size, self.batch_size, self.train_freq, self.gradient_steps)
        _check(min(positive) > 0, "sac: sizes and frequencies are positive")
        _check(0 < self.gamma <= 1 and 0 < self.tau <= 1, "sac: gamma and tau in 0..1")


@dataclass(frozen=True)
class Imitation:
    """Before learning: fit the policy to a teacher (PPO).

    The teacher is :mod:`robofish_agents.training.teacher`.

    Attributes:
        rounds: number of episodes of all fish, the first swum by the teacher; 0: none.
        epochs: passes through what was collected, after each round.
        gains: gains of the teacher that differ from those of the PID controller, see
            :class:`robofish_agents.training.teacher_gains.TeacherGains`.
        stretch: factor of the fitted block displacement, applied at the end.
    """

    rounds: int = 0
    epochs: int = 8
    stretch: float = 1.0
    gains: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self.rounds >= 0 and self.epochs > 0, "imitate: rounds >= 0 and epochs > 0")
        _check(self.stretch > 0.0, "imitate: stretch > 0")
        for name, value in self.gains.items():
            known = ", ".join(TEACHER_GAIN_NAMES)
            _check(
                name in TEACHER_GAIN_NAMES, f"imitate.gains: unknown gain '{name}'; known: {known}"
            )
            _check(is_number(value), f"imitate.gains.{name} must be a finite number")


@dataclass(frozen=True)
class Evaluation:
    """Evaluation during training, on episodes that are not trained on and belong to no suite.

    Attributes:
        every: steps between two evaluations; the best policy is kept.
        episodes: how many.
    """

    every: int = 200_000
    episodes: int = 64

    def __post_init__(self) -> None:
        _check(min(self.every, self.episodes) > 0, "evaluation: every and episodes are positive")


@dataclass(frozen=True)
class Threads:
    """Threads of PyTorch and of the environment; small networks do not gain from more."""

    torch: int = 1
    environment: int = 1

    def __post_init__(self) -> None:
        _check(min(self.torch, self.environment) > 0, "threads: at least 1")


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
        _check(self.algorithm in ("ppo", "sac"), "algorithm: ppo or sac")
        _check(self.engine in ENGINES, f"engine: one of {', '.join(ENGINES)}")
        if self.engine == "rllib":
            self._check_rllib()
        if self.engine == "tensor":
            self._check_tensor()
        else:
            _check(self.critic == Critic(), f"critic: engine {self.engine} has none of its own")
            _check(self.teacher == Teaching(), f"teacher: engine {self.engine} has none")
        _check(0 <= self.seed < 1_000_000, "seed: 0 to 999999")
        _check(1 <= self.num_envs <= MOST_FISH, f"num_envs: 1 to {MOST_FISH}")
        _check(min(self.total_steps, self.checkpoint_every) > 0, "steps must be positive")
        rollout = self.ppo.n_steps * self.num_envs
        _check(
            self.algorithm != "ppo" or rollout % self.ppo.batch_size == 0,
            f"ppo.batch_size must divide n_steps x num_envs, {rollout}",
        )
        for key, own in {"task": "task", "config": "settings"}.items():
            _check(
                key not in self.environment or not getattr(self, own),
                f"environment.{key}: not together with '{own}'",
            )
        known = inspect.signature(env_options).parameters
        _check(TRUST not in self.environment, f"environment.{TRUST}: {NOT_BY_FILE}")
        for key in self.environment:
            _check(key in known, f"environment: unknown key '{key}'; known: {', '.join(known)}")
        _check(self.algorithm == "ppo" or not self.imitate.rounds, "imitate: needs ppo")
        names = self.disturbances
        _check(bool(names), "disturbances: at least one suite")
        _check(self.num_envs % len(names) == 0, "num_envs: the same number for each disturbance")
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
        _check(self.algorithm == "ppo", "algorithm: " + without.format("choose ppo"))
        _check(self.ppo.target_kl is None, "ppo.target_kl: " + without.format("remove it"))
        _check(not self.ppo.use_sde, "ppo.use_sde: " + without.format("remove it"))

    def _check_tensor(self) -> None:
        """Refuses settings that PPO over tensors does not have."""
        without = "engine tensor has no equal; {}, or train with --engine sb3"
        _check(self.algorithm == "ppo", "algorithm: " + without.format("choose ppo"))
        _check(not self.ppo.use_sde, "ppo.use_sde: " + without.format("remove it"))
        _check(not self.imitate.rounds, "imitate: " + without.format("remove it"))
        taught = self.teacher.steps + self.teacher.distil_steps
        _check(taught <= self.total_steps, "teacher: steps and distil_steps within total_steps")
        _check(not taught or self.critic.privileged, "teacher: needs critic.privileged: true")

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
