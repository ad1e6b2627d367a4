"""A policy as a C header: C99, no dependency but the standard library."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.envs.layout import OBSERVATION, OBSERVATION_LIMIT
from fish_env.files import check_outputs, write_bytes
from robofish_agents.deployment.contract import (
    Settings,
    contract_path,
    environment_settings,
    make_contract,
    write_contract,
)
from robofish_agents.deployment.memory import Memory
from robofish_agents.deployment.quantisation import quantise
from robofish_agents.policies.files import ACTIONS, PolicyFile

TEMPLATE = "policy.h.in"
SIZE = len(OBSERVATION)
WIDTH = 96
TANH = "@UPPER@_TANH(sum)"
ACTIVE = {"tanh": TANH, "relu": "sum > 0 ? sum : 0"}
OUTPUT = {"tanh": f"(float){TANH}", "clip": "(float)@NAME@_limited(sum, 1)"}


def export_c(
    policy: PolicyFile, file: str | Path, settings: Settings = None, int8: bool = False
) -> list[Path]:
    """Writes a policy as a C header, and its contract beside it.

    The names in the header begin with the name of the file: ``hold.h`` has ``hold_act``.

    Args:
        policy: what :func:`robofish_agents.policies.read_policy` returned.
        file: the header to write.
        settings: of the environment, where the policy's card does not hold them.
        int8: store weights with eight bits; actions then differ a little from the policy's.

    Returns:
        The header and the contract.

    Raises:
        ConfigError: the settings do not fit the policy.
        OutputError: a file cannot be written.
    """
    check_outputs([file, contract_path(file)])
    name = prefix_of(file)
    interface = {
        "kind": "c",
        "prefix": name,
        "weights": "int8, a scale for each output" if int8 else "float32",
        "arithmetic": f"double; float if {name.upper()}_SINGLE is defined",
    }
    config = environment_settings(policy, settings)
    contract = make_contract(policy, config, interface)
    content = _header(policy, contract, contract_path(file).name, int8).encode("ascii")
    write_bytes(file, content)
    return [Path(file), write_contract(contract, file, content)]


def prefix_of(file: str | Path) -> str:
    """Returns what the names in a header begin with: the name of its file, as an identifier."""
    name = re.sub(r"[^a-z0-9]+", "_", Path(file).name.partition(".")[0].lower()).strip("_")
    return name if name and name[0].isalpha() else f"policy_{name}".rstrip("_")


def _header(policy: PolicyFile, contract: dict[str, Any], contract_name: str, int8: bool) -> str:
    memory = Memory.of(policy)
    name, actions = contract["interface"]["prefix"], contract["action"]["entries"]
    about = (
        f"Policy for {contract['environment']}, task {contract['task']}; "
        f"written by {contract['made_with']}."
    )
    sizes = [len(bias) for bias in policy.network.biases[:-1]]
    locals_ = "".join(f"  @NAME@_real hidden_{i}[{size}];\n" for i, size in enumerate(sizes))
    parts = {
        "NUMBERS": _numbers(policy, contract, int8),
        "LAYERS": _layers(policy, int8),
        "MEMORY": _memory(memory),
        "LOCALS": locals_,
        "ABOUT": _printable(about),
        "CONTRACT": _printable(contract_name),
        "GUARD": f"{name.upper()}_H",
        "UPPER": name.upper(),
        "RATE": f"{contract['rate_hz']:g}",
        "RATE_F": _float(contract["rate_hz"]),
        "LIMIT": _float(OBSERVATION_LIMIT),
        "NORMAL_LIMIT": f"{policy.network.limit:.17g}",
        "OBSERVATIONS": str(SIZE),
        "ACTIONS": str(ACTIONS),
        "PAST": str(max(memory.size, 1)),
        "SEEN": str(SIZE + memory.size),
        "TARGETS": ", ".join(f"{a['name']} ({a['unit']})" for a in actions),
        "NAME": name,
    }
    text = (files("robofish_agents.deployment") / TEMPLATE).read_text(encoding="ascii")
    for key, value in parts.items():
        text = text.replace(f"@{key}@", value)
    return text


def _printable(text: str) -> str:
    """A text that a comment can hold."""
    plain = text.encode("ascii", "replace").decode("ascii").replace("*/", "* /")
    return "".join(character if character.isprintable() else "?" for character in plain)


def _float(number: float | np.floating[Any]) -> str:
    """A single-precision constant that reads back as the same number."""
    text = f"{np.float32(number):.9g}"
    return f"{text}f" if re.search(r"[.e]", text) else f"{text}.0f"


def _array(kind: str, name: str, values: np.ndarray, form: str = "") -> str:
    """The definition of a constant array, in lines that a person can look at."""
    flat = values.ravel()
    write = form.format if form else (str if values.dtype.kind == "i" else _float)
    numbers = map(write, flat)
    lines, line = [], " "
    for number in numbers:
        if len(line) + len(number) + 2 > WIDTH:
            lines.append(line)
            line = " "
        line += f" {number},"
    lines.append(line)
    return f"static const {kind} @NAME@_{name}[{flat.size}] = {{\n" + "\n".join(lines) + "\n};"


def _numbers(policy: PolicyFile, contract: dict[str, Any], int8: bool) -> str:
    network, memory = policy.network, Memory.of(policy)
    mean = network.mean.astype(np.float32)
    actions = contract["action"]["entries"]
    arrays = [
        # Of two numbers each, so that single precision suffices for what hardly varies.
        _array("float", "mean", mean),
        _array("float", "mean_rest", (network.mean - mean.astype(float)).astype(np.float32)),
        _array("@NAME@_real", "scale", network.scale, "{:.17g}"),
        _array("float", "low", np.array([action["low"] for action in actions])),
        _array("float", "high", np.array([action["high"] for action in actions])),
    ]
    if len(memory.shares):
        arrays.append(_array("float", "shares", memory.shares))
    for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        if int8:
            whole, scale = quantise(weight)
            arrays.append(_array("signed char", f"weight_{i}", whole))
            arrays.append(_array("float", f"step_{i}", scale))
        else:
            arrays.append(_array("float", f"weight_{i}", weight))
        arrays.append(_array("float", f"bias_{i}", bias))
    return "\n".join(arrays)


def _memory(memory: Memory) -> str:
    """Statements that keep the past as :class:`robofish_agents.policies.history.History` does."""
    lines = [f"for (i = 0; i < {SIZE}; ++i) {{"]
    if memory.rows:
        lines += [
            "  float *past = memory->past + i;",
            "  const float now = observation[i];",
            "  if (!memory->started) {",
            f"    for (j = 0; j < {memory.rows}; ++j) {{",
            f"      past[{SIZE} * j] = now;",
            "    }",
            "  }",
            "  seen[i] = now;",
        ]
    else:
        lines.append("  seen[i] = observation[i];")
    if memory.frames:
        lines += [
            f"  for (j = 0; j < {memory.frames}; ++j) {{",
            f"    seen[i + {SIZE} * (j + 1)] = past[{SIZE} * j];",
            "  }",
            f"  for (j = {memory.frames - 1}; j > 0; --j) {{",
            f"    past[{SIZE} * j] = past[{SIZE} * (j - 1)];",
            "  }",
            "  past[0] = now;",
        ]
    if len(memory.shares):
        row = f"{SIZE} * (j + {memory.frames})" if memory.frames else f"{SIZE} * j"
        lines += [
            f"  for (j = 0; j < {len(memory.shares)}; ++j) {{",
            f"    float *filtered = past + {row};",
            "    *filtered += @NAME@_shares[j] * (now - *filtered);",
            f"    seen[i + {SIZE} * (j + {memory.frames + 1})] = *filtered;",
            "  }",
        ]
    lines += ["}", "memory->started = 1;"]
    return "\n".join(f"  {line}" for line in lines)


def _layers(policy: PolicyFile, int8: bool) -> str:
    """Statements of the layers; hidden_I is what layer I hands on."""
    network, lines = policy.network, []
    last = len(network.weights) - 1
    for i, weight in enumerate(network.weights):
        outputs, inputs = weight.shape
        source = "normal" if i == 0 else f"hidden_{i - 1}"
        target = "action" if i == last else f"hidden_{i}"
        act = OUTPUT[network.output] if i == last else ACTIVE[network.activation]
        lines += [
            f"for (i = 0; i < {outputs}; ++i) {{",
            "  @NAME@_real sum = 0;",
            f"  for (j = 0; j < {inputs}; ++j) {{",
            f"    sum += @NAME@_weight_{i}[{inputs} * i + j] * {source}[j];",
            "  }",
            *([f"  sum *= @NAME@_step_{i}[i];"] if int8 else []),
            f"  sum += @NAME@_bias_{i}[i];",
            f"  {target}[i] = {act};",
            "}",
        ]
    return "\n".join(f"  {line}" for line in lines)
