"""Parts of a training's configuration: networks, algorithms, teachers, evaluations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from fish_env.errors import ConfigError
from fish_env.reading import is_number
from robofish_agents.policies.files import ACTIONS
from robofish_agents.policies.network import ACTIVATIONS
from robofish_agents.training.teacher_gains import TEACHER_GAIN_NAMES


def check(holds: bool, message: str) -> None:
    """Refuses a setting unless something holds.

    Raises:
        ConfigError: with the message.
    """
    if not holds:
        raise ConfigError(message)


def _check_falls(section: str, first: float, last: float | None) -> None:
    """Refuses a limit of the deviation that would rise."""
    check(last is None or last <= first, f"{section}.log_std_end: at most log_std_init")


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
        log_std_end: an upper limit of that logarithm falls to it in a straight line (engine
            ``tensor``); None: none.
        first_action: mean action before anything is learnt (PPO); zeros if empty.
    """

    layers: tuple[int, ...] = (64, 64)
    activation: str = "tanh"
    log_std_init: float = -0.5
    log_std_end: float | None = None
    first_action: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check(bool(self.layers) and min(self.layers) > 0, "network.layers: positive widths")
        _check_falls("network", self.log_std_init, self.log_std_end)
        names = ", ".join(ACTIVATIONS)
        check(self.activation in ACTIVATIONS, f"network.activation: one of {names}")
        first = self.first_action
        check(
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
        check(min(self.layers, default=1) > 0, "critic.layers: positive widths")


@dataclass(frozen=True)
class LearningRate:
    """Step size of Adam: constant, or falling in a straight line from ``start`` to ``end``."""

    start: float = 3e-4
    end: float | None = None

    def __post_init__(self) -> None:
        check(self.start > 0, "learning_rate.start must be positive")
        check(self.end is None or self.end >= 0, "learning_rate.end must not be negative")


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
        check(min(self.steps, self.distil_steps) >= 0, "teacher: steps, distil_steps >= 0")
        check(self.distil_steps == 0 or self.steps > 0, "teacher.distil_steps: needs steps")
        check(bool(self.layers) and min(self.layers) > 0, "teacher.layers: positive widths")
        check(self.distil_epochs > 0, "teacher.distil_epochs: positive")
        _check_falls("teacher", self.log_std_init, self.log_std_end)


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
        check(min(positive) > 0, "ppo: n_steps, batch_size, n_epochs, clip_range are positive")
        check(0 < self.gamma <= 1 and 0 <= self.gae_lambda <= 1, "ppo: gamma, gae_lambda in 0..1")


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
        check(min(positive) > 0, "sac: sizes and frequencies are positive")
        check(0 < self.gamma <= 1 and 0 < self.tau <= 1, "sac: gamma and tau in 0..1")


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
        check(self.rounds >= 0 and self.epochs > 0, "imitate: rounds >= 0 and epochs > 0")
        check(self.stretch > 0.0, "imitate: stretch > 0")
        for name, value in self.gains.items():
            known = ", ".join(TEACHER_GAIN_NAMES)
            check(
                name in TEACHER_GAIN_NAMES, f"imitate.gains: unknown gain '{name}'; known: {known}"
            )
            check(is_number(value), f"imitate.gains.{name} must be a finite number")


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
        check(min(self.every, self.episodes) > 0, "evaluation: every and episodes are positive")


@dataclass(frozen=True)
class Threads:
    """Threads of PyTorch and of the environment; small networks do not gain from more."""

    torch: int = 1
    environment: int = 1

    def __post_init__(self) -> None:
        check(min(self.torch, self.environment) > 0, "threads: at least 1")
