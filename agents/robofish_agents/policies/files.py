"""Policy files: an ``.npz`` of plain arrays and one JSON text. Loading one cannot run code.

NumPy's archive is read with ``allow_pickle=False``; whatever is in it is checked for type, shape,
finiteness and a checksum before it is used.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.archives import UNREADABLE, Arrays, digest, read_arrays
from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from fish_env.files import write_bytes
from fish_env.reading import Unreadable, located, parse_json, read_bytes, short, shown
from robofish_agents.policies.history import HistorySpec
from robofish_agents.policies.network import ACTIVATIONS, OUTPUTS, Network

FORMAT = "robofish-policy-1"
ACTIONS = 5
MOST_LAYERS = 20
MOST_BYTES = 20_000_000
"""A policy file is some tens of kilobytes; a larger archive is not unpacked."""


@dataclass(frozen=True, eq=False)
class PolicyFile:
    """What a policy file holds.

    Attributes:
        network: forward pass.
        history: past observations that it sees.
        task: task it was trained for.
        environment: id and version of the environment.
        card: origin: configuration, seed, training time, scores.
    """

    network: Network
    history: HistorySpec
    task: str
    environment: str
    card: Mapping[str, Any]


def write_policy(policy: PolicyFile, path: Path) -> None:
    """Writes a policy atomically."""
    network, history = policy.network, policy.history
    arrays: dict[str, Any] = {"mean": network.mean, "scale": network.scale}
    for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        arrays |= {f"weight_{i}": weight, f"bias_{i}": bias}
    text = {
        "format": FORMAT,
        "environment": policy.environment,
        "task": policy.task,
        "observation": len(OBSERVATION),
        "actions": ACTIONS,
        "layers": len(network.weights),
        "limit": network.limit,
        "activation": network.activation,
        "output": network.output,
        "frames": history.frames,
        "low_pass_s": list(history.low_pass_s),
        "period_s": history.period_s,
        "card": dict(policy.card),
    }
    document = json.dumps(text, sort_keys=True)
    buffer = io.BytesIO()
    np.savez(buffer, about=np.array(document), digest=np.array(digest(document, arrays)), **arrays)
    write_bytes(path, buffer.getvalue())


def read_policy(path: str | Path) -> PolicyFile:
    """Reads a policy file.

    Raises:
        ConfigError: no such file; not a policy file; damaged; of another environment, environment
            version or observation.
    """
    file = Path(path)
    arrays = _unpack(file)
    document = _text(file, arrays, "about")
    try:
        about = parse_json(document)
    except Unreadable as error:
        raise ConfigError(f"{file}: its description: {error.reason}; it is damaged") from None
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        raise ConfigError(f"{file}: not a policy file of the format {FORMAT}")
    _check_environment(file, about)
    numbers = {name: value for name, value in arrays.items() if name not in ("about", "digest")}
    if _text(file, arrays, "digest") != digest(document, numbers):
        raise ConfigError(f"{file}: its checksum does not fit; it was changed or is damaged")
    try:
        return _build(about, numbers)
    except ConfigError as error:
        raise ConfigError(f"{file}: {error}; it is damaged") from None
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ConfigError(f"{file}: {error!r} in its description; it is damaged") from None


def _unpack(file: Path) -> dict[str, npt.NDArray[Any]]:
    try:
        if not located(file).is_file():
            raise ConfigError(f"{file}: no such policy file; check the path of policy.npz")
        content = read_bytes(file, MOST_BYTES)
        return read_arrays(content, MOST_BYTES)
    except Unreadable as error:
        raise ConfigError(f"{file}: {error}") from None
    except UNREADABLE as error:
        raise ConfigError(
            f"{file}: not a readable policy file ({error}); it is truncated or damaged"
        ) from None


def _text(file: Path, arrays: Arrays, name: str) -> str:
    value = arrays.get(name)
    if value is None or value.dtype.kind != "U" or value.shape != ():
        raise ConfigError(f"{file}: not a policy file, it has no text '{name}'")
    return str(value)


def _check_environment(file: Path, about: Mapping[str, Any]) -> None:
    if about.get("environment") != ENV_ID:
        raise ConfigError(
            f"{file}: trained in {short(str(about.get('environment')))}, and this is {ENV_ID}, "
            "which behaves differently; train it again, or install the version of the package that "
            "it belongs to"
        )
    sizes = (about.get("observation"), about.get("actions"))
    if sizes != (len(OBSERVATION), ACTIONS):
        raise ConfigError(
            f"{file}: for {shown(sizes[0])} observations and {shown(sizes[1])} actions; {ENV_ID} "
            f"has {len(OBSERVATION)} and {ACTIONS}"
        )


def _build(about: Mapping[str, Any], arrays: Arrays) -> PolicyFile:
    history = HistorySpec(
        int(about["frames"]), tuple(map(float, about["low_pass_s"])), float(about["period_s"])
    )
    layers = int(about["layers"])
    if not 1 <= layers <= MOST_LAYERS:
        raise ValueError(f"{shown(layers)} layers")
    weights = tuple(arrays[f"weight_{i}"] for i in range(layers))
    biases = tuple(arrays[f"bias_{i}"] for i in range(layers))
    network = Network(
        arrays["mean"], arrays["scale"], float(about["limit"]), weights, biases,
        str(about["activation"]), str(about["output"]),
    )  # fmt: skip
    _check_network(network, history.width(len(OBSERVATION)))
    return PolicyFile(
        network, history, str(about["task"]), str(about["environment"]), dict(about["card"])
    )


def _check_network(network: Network, seen: int) -> None:
    if not 0.0 < network.limit < np.inf:
        raise ValueError(f"a limit of {network.limit}")
    if network.activation not in ACTIVATIONS or network.output not in OUTPUTS:
        raise ValueError(f"unknown '{network.activation}' or '{network.output}'")
    if network.mean.dtype.kind != "f" or network.scale.dtype.kind != "f":
        raise ValueError("the normalisation must be floating-point numbers")
    if network.mean.shape != (seen,) or network.scale.shape != (seen,):
        raise ValueError("the normalisation does not fit the observation")
    width = seen
    for weight, bias in zip(network.weights, network.biases, strict=True):
        if weight.dtype != np.float32 or bias.dtype != np.float32 or bias.ndim != 1:
            raise ValueError("layers must be float32")
        if weight.shape != (len(bias), width):
            raise ValueError(f"a layer of shape {weight.shape} after {width} numbers")
        width = len(bias)
    if width != ACTIONS:
        raise ValueError(f"{width} actions")
    numbers: tuple[npt.NDArray[Any], ...] = (
        *(network.mean, network.scale),
        *network.weights,
        *network.biases,
    )
    if not all(np.all(np.isfinite(array)) for array in numbers) or np.any(network.scale <= 0.0):
        raise ValueError("numbers that are not finite, or a scale that is not positive")
