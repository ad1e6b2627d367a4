"""Recorded episodes: what an environment was given and what it gave back, replayed bit by bit.

A file is an archive of arrays with one JSON text (`.npz`), no pickle. It is checked before use, and
reading it runs no code.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit

from fish_env.archives import UNREADABLE, digest, read_arrays
from fish_env.arrays import FloatArray
from fish_env.envs.batch import generator, physics_of, real_actions
from fish_env.envs.layout import OBSERVATION
from fish_env.envs.options import EnvOptions
from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import ACTION_SHAPE, RoboticFish3DEnv
from fish_env.errors import ConfigError
from fish_env.files import write_bytes
from fish_env.params.schema import FishParams
from fish_env.reading import Unreadable, located, parse_json, read_bytes, short, shown

FORMAT = "robofish-episode-1"
DISTRIBUTION = "robotic-fish"
MOST_BYTES = 200_000_000
"""Of a file, packed or not: a million steps."""
PLAIN_WRAPPERS = (TimeLimit, OrderEnforcing, PassiveEnvChecker)
"""Wrappers that `gymnasium.make` puts around an environment; they change neither actions nor
observations."""
NOT_KEPT = ("render_mode", "render_size", "trust_effects")
"""Options that do not change an episode, and trust, which no file can give."""
NUMBERS = ("actions", "observations", "rewards", "terminated", "truncated")
Fish = FishParams | str | Path


@dataclass(frozen=True, eq=False)
class Episode:
    """One recorded episode of T steps.

    Attributes:
        about: environment, package version, hashes of physics and model, options, reset.
        actions: (T, 5) float32, as given to the environment.
        observations: (T + 1, 33) float32, the one of the reset first.
        rewards: (T,) float64.
        terminated: (T,) bool.
        truncated: (T,) bool.
    """

    about: Mapping[str, Any]
    actions: npt.NDArray[np.float32]
    observations: npt.NDArray[np.float32]
    rewards: FloatArray
    terminated: npt.NDArray[np.bool_]
    truncated: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Replayed:
    """A replay beside its record.

    Attributes:
        recorded: the episode of the file.
        replayed: the episode as it went this time.
        differs_at: first step whose observation, reward or end differs in any bit; 0 is the
            reset. None if none does.
    """

    recorded: Episode
    replayed: Episode
    differs_at: int | None

    @property
    def exact(self) -> bool:
        """Whether every bit is the same."""
        return self.differs_at is None


class EpisodeRecorder(gym.Wrapper[Any, Any, Any, Any]):
    """Keeps the present episode of ``RoboticFish3D-v0``, to be saved and replayed.

    Args:
        env: what ``gymnasium.make("RoboticFish3D-v0", ...)`` returns. Wrappers that change actions,
            rewards or observations go around the recorder.

    Raises:
        ConfigError: another environment, or a wrapper inside that may change what is recorded.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        inner: Any = env
        while isinstance(inner, gym.Wrapper):
            if not isinstance(inner, PLAIN_WRAPPERS):
                raise ConfigError(
                    f"EpisodeRecorder: {type(inner).__name__} is inside the recorder and may "
                    "change what is recorded; wrap the recorder in it instead"
                )
            inner = inner.env
        if not isinstance(inner, RoboticFish3DEnv) or env.spec is None:
            raise ConfigError(f"EpisodeRecorder: give what gymnasium.make('{ENV_ID}', ...) returns")
        self._fish: RoboticFish3DEnv = inner
        self._options = _plain_options(env.spec.kwargs, inner.options)
        self._limit = env.spec.max_episode_steps
        self._reset: dict[str, Any] | None = None
        self._steps: list[tuple[Any, ...]] = []
        self._first: npt.NDArray[np.float32] | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; what was recorded before is forgotten."""
        state = None if seed is not None else self._fish.np_random.bit_generator.state
        obs, info = self.env.reset(seed=seed, options=options)
        plain = _plain({} if options is None else options, "reset options")
        self._reset = {"seed": seed, "random": state, "options": plain}
        self._steps, self._first = [], obs.copy()
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """One control step, kept."""
        given = real_actions(action, ACTION_SHAPE).astype(np.float32)
        obs, reward, terminated, truncated, info = self.env.step(given)
        self._steps.append((given, obs.copy(), reward, terminated, truncated))
        return obs, reward, terminated, truncated, info

    @property
    def episode(self) -> Episode:
        """The present episode so far.

        Raises:
            ConfigError: before the first reset.
        """
        if self._reset is None or self._first is None:
            raise ConfigError("EpisodeRecorder: call reset() before the episode is asked for")
        about = _identity(self._fish.options) | {
            "options": self._options,
            "max_episode_steps": self._limit,
            "reset": self._reset,
        }
        return _episode(about, self._first, self._steps)

    def save(self, path: str | Path) -> None:
        """Writes the present episode so far, see :func:`write_episode`.

        Raises:
            ConfigError: before the first reset.
            OutputError: the file cannot be written.
        """
        write_episode(self.episode, path)


def write_episode(episode: Episode, path: str | Path) -> None:
    """Writes an episode; the file is there whole or not at all.

    Args:
        episode: what was recorded.
        path: the file, ``.npz``.

    Raises:
        OutputError: the file cannot be written.
    """
    document = json.dumps(dict(episode.about))  # the order of draws is that of the options
    arrays = {name: getattr(episode, name) for name in NUMBERS}
    buffer = io.BytesIO()
    checksum = np.array(digest(document, arrays))
    np.savez_compressed(buffer, about=np.array(document), digest=checksum, **arrays)
    write_bytes(path, buffer.getvalue())


def read_episode(path: str | Path) -> Episode:
    """Reads an episode. Runs no code, whatever the file holds.

    Args:
        path: the file.

    Raises:
        ConfigError: no such file, no recorded episode, or a damaged one.
    """
    file = Path(path)
    try:
        arrays = read_arrays(read_bytes(located(file), MOST_BYTES), MOST_BYTES)
        document = str(arrays.pop("about"))
        checksum = str(arrays.pop("digest"))
        about = parse_json(document)
        if not isinstance(about, dict) or about.get("format") != FORMAT:
            raise ConfigError(f"{file}: no recorded episode of the format {FORMAT}")
        if checksum != digest(document, arrays):
            raise ConfigError(f"{file}: its checksum does not fit; it was changed or is damaged")
        return _checked(Episode(about, **{name: arrays.pop(name) for name in NUMBERS}))
    except FileNotFoundError:
        raise ConfigError(f"{file}: no such file; give a file that a recorder saved") from None
    except Unreadable as error:
        raise ConfigError(f"{file}: {error}") from None
    except UNREADABLE as error:
        raise ConfigError(
            f"{file}: not a readable episode ({short(str(error))}); it is truncated or "
            "damaged; record it again"
        ) from None


def replay_episode(
    path: str | Path,
    fish: Fish | None = None,
    trust_effects: bool = False,
    any_version: bool = False,
) -> Replayed:
    """Swims a recorded episode again and compares every bit.

    Args:
        path: a file that :meth:`EpisodeRecorder.save` wrote.
        fish: the fish of the episode, if its file has moved or it was given as parameters.
        trust_effects: run the effect files that the fish's file names.
        any_version: replay it even if it was recorded with another version of the package, the
            physics or the fish; the bits may then differ.

    Returns:
        Both episodes, and the first step that differs.

    Raises:
        ConfigError: the file cannot be read, or it was recorded with another version; says which.
        ParameterError, EffectError: the fish of the episode cannot be used.
    """
    file, recorded = Path(path), read_episode(path)
    about = recorded.about
    _check_named(file, about)
    if not any_version:
        _check_package(file, about)
    options = dict(about["options"])
    if fish is not None:
        options["fish"] = fish
    elif options.get("fish", "") is None:
        raise ConfigError(f"{file}: its fish was given as parameters; give them with fish=")
    try:
        env: gym.Env[Any, Any] = gym.make(
            ENV_ID,
            max_episode_steps=about["max_episode_steps"],
            **options,
            trust_effects=trust_effects,
        )
        inner: Any = env.unwrapped
        if not any_version:
            _check_model(file, about, _identity(inner.options))
        replayed = _swim(EpisodeRecorder(env), about["reset"], recorded.actions)
    except (KeyError, TypeError, ValueError, AssertionError, OverflowError) as error:
        raise ConfigError(
            f"{file}: {short(repr(error))} in its description; record it again"
        ) from None
    return Replayed(recorded, replayed, _difference(recorded, replayed))


def package_version() -> str:
    """The version of robotic-fish that is installed; "unknown" if it only lies on the path."""
    try:
        return importlib.metadata.version(DISTRIBUTION)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def _identity(options: EnvOptions) -> dict[str, Any]:
    """What must be the same for the same bits."""
    model, config, setup = options.model, options.config, options.config.setup(options.task)
    numbers = (model.record, model.tables, setup, config.slew, config.low, config.high)
    sums = hashlib.sha256("|".join(effect.name for effect in model.declared).encode())
    for array in numbers:
        sums.update(np.ascontiguousarray(array).tobytes())
    return {
        "format": FORMAT,
        "environment": ENV_ID,
        "package": package_version(),
        "physics": physics_of(options),
        "model": sums.hexdigest()[:16],
    }


def _check_named(file: Path, about: Mapping[str, Any]) -> None:
    if about.get("environment") != ENV_ID:
        raise ConfigError(
            f"{file}: recorded in {short(str(about.get('environment')))}, and this is {ENV_ID}, "
            "which behaves differently; install the version of robotic-fish that has it"
        )
    if not isinstance(about.get("options"), dict) or not isinstance(about.get("reset"), dict):
        raise ConfigError(f"{file}: it has no options or no reset; record it again")
    steps = about.get("max_episode_steps")
    if steps is not None and (type(steps) is not int or steps < 1):
        raise ConfigError(f"{file}: max_episode_steps {shown(steps)}; record it again")


def _check_package(file: Path, about: Mapping[str, Any]) -> None:
    if about.get("package") != package_version():
        raise ConfigError(
            f"{file}: recorded with robotic-fish {short(str(about.get('package')))}, and this is "
            f"{package_version()}; install that version, or replay it with any_version=True to see "
            "what differs"
        )


def _check_model(file: Path, about: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    if about.get("physics") != now["physics"]:
        raise ConfigError(
            f"{file}: recorded with other physics (the sources of the kernels or numba differ); "
            "install the versions it was recorded with, or replay it with any_version=True"
        )
    if about.get("model") != now["model"]:
        raise ConfigError(
            f"{file}: the fish or the settings of the environment are not those that were "
            "recorded; give the right fish with fish=, or replay it with any_version=True"
        )


def _swim(
    env: EpisodeRecorder, reset: Mapping[str, Any], actions: npt.NDArray[np.float32]
) -> Episode:
    if reset["random"] is not None:
        env.unwrapped.np_random = generator(reset["random"])
    env.reset(seed=reset["seed"], options=dict(reset["options"]))
    for action in actions:
        env.step(action)
    return env.episode


def _difference(one: Episode, other: Episode) -> int | None:
    """The first step at which two episodes of the same length differ in a bit."""
    same = [_bits(one.observations) == _bits(other.observations)]
    for name in NUMBERS[2:]:
        equal = _bits(getattr(one, name)) == _bits(getattr(other, name))
        same.append(np.concatenate([np.ones((1, equal.shape[1]), bool), equal]))
    wrong = np.flatnonzero(~np.concatenate(same, axis=1).all(axis=1))
    return int(wrong[0]) if len(wrong) else None


def _bits(array: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """(T, bytes): NaN equals itself and -0 is not 0."""
    return np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1)


def _episode(
    about: Mapping[str, Any], first: npt.NDArray[np.float32], steps: list[tuple[Any, ...]]
) -> Episode:
    actions, observations, *rest = zip(*steps, strict=True) if steps else ((), (), (), (), ())
    rewards, terminated, truncated = rest
    return Episode(
        about,
        np.array(actions, np.float32).reshape(-1, *ACTION_SHAPE),
        np.array([first, *observations], np.float32),
        np.array(rewards, np.float64),
        np.array(terminated, bool),
        np.array(truncated, bool),
    )


def _checked(episode: Episode) -> Episode:
    count = len(episode.rewards) if episode.rewards.ndim else -1
    wanted = {
        "actions": (np.float32, (count, *ACTION_SHAPE)),
        "observations": (np.float32, (count + 1, len(OBSERVATION))),
        "rewards": (np.float64, (count,)),
        "terminated": (np.bool_, (count,)),
        "truncated": (np.bool_, (count,)),
    }
    for name, (kind, shape) in wanted.items():
        array = getattr(episode, name)
        if array.dtype != kind or array.shape != shape:
            raise ValueError(f"{name} of type {array.dtype} and shape {array.shape}")
    return episode


def _plain_options(given: Mapping[str, Any], options: EnvOptions) -> dict[str, Any]:
    kept = {name: value for name, value in given.items() if name not in NOT_KEPT}
    if isinstance(kept.get("config"), (str, Path)):
        kept["config"] = options.config.tree  # the file may change
    if isinstance(kept.get("fish"), FishParams):
        kept["fish"] = None
    return {name: _plain(value, f"option {name}") for name, value in kept.items()}


def _plain(value: Any, name: str) -> Any:
    """A value as JSON has it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist(), name)
    if isinstance(value, (list, tuple)):
        return [_plain(item, name) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, name) for key, item in value.items()}
    raise ConfigError(f"EpisodeRecorder: {name} holds {type(value).__name__}, which no file keeps")
