"""A policy as an ONNX model: memory, normalisation and layers in one graph."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fish_env.envs.layout import OBSERVATION
from fish_env.errors import missing_extra
from fish_env.files import check_outputs, write_bytes
from robofish_agents.deployment.contract import (
    Settings,
    contract_path,
    environment_settings,
    make_contract,
    write_contract,
)
from robofish_agents.deployment.memory import Memory
from robofish_agents.policies.files import ACTIONS, PolicyFile

OPSET = 17
IR_VERSION = 8
"""Of 2022: runtimes since then can read the model."""
SIZE = len(OBSERVATION)
BATCH = "fish"
OPERATORS = {"tanh": "Tanh", "relu": "Relu", "clip": "Clip"}


def export_onnx(policy: PolicyFile, file: str | Path, settings: Settings = None) -> list[Path]:
    """Writes a policy as an ONNX model, and its contract beside it.

    The model takes observations as the environment gives them. Its inputs are ``observation``
    (N, 33) and, for a policy that sees the past, ``past`` (N, ...) and ``first`` (N, 1); it
    returns ``action`` (N, 5) in [-1, 1] and ``next_past``. The contract is in the model's metadata
    too, under ``contract``.

    Args:
        policy: what :func:`robofish_agents.policies.read_policy` returned.
        file: the model to write.
        settings: of the environment, where the policy's card does not hold them.

    Returns:
        The model and the contract.

    Raises:
        MissingExtraError: the package onnx is not installed.
        ConfigError: the settings do not fit the policy.
        OutputError: a file cannot be written.
    """
    check_outputs([file, contract_path(file)])
    memory = Memory.of(policy)
    interface = {"kind": "onnx", "opset": OPSET, **_interface(memory)}
    contract = make_contract(policy, environment_settings(policy, settings), interface)
    model = _model(policy, memory, contract)
    content = model.SerializeToString(deterministic=True)
    write_bytes(file, content)
    return [Path(file), write_contract(contract, file, content)]


def _interface(memory: Memory) -> dict[str, Any]:
    inputs = {"observation": f"float32 ({BATCH}, {SIZE})"}
    outputs = {"action": f"float32 ({BATCH}, {ACTIONS})"}
    if memory.rows:
        past = f"float32 ({BATCH}, {memory.size})"
        inputs |= {
            "past": f"{past}: next_past of the step before; zeros at the start",
            "first": f"bool ({BATCH}, 1): true in the first step of a swim",
        }
        outputs["next_past"] = past
    return {"inputs": inputs, "outputs": outputs}


class _Graph:
    """Collects nodes and constants; each node returns the name of its output."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, name: str, value: npt.ArrayLike) -> str:
        """Adds a constant of the type that the array has."""
        self.constants.append(self.onnx.numpy_helper.from_array(np.asarray(value), name))
        return name

    def node(self, operator: str, inputs: list[str], output: str, **options: Any) -> str:
        """Adds a node with one output."""
        made = self.onnx.helper.make_node(operator, inputs, [output], name=output, **options)
        self.nodes.append(made)
        return output

    def double(self, values: str) -> str:
        """The same in double precision."""
        kind = self.onnx.TensorProto.DOUBLE
        return self.node("Cast", [values], f"{values}_double", to=kind)

    def part(self, values: str, start: int, end: int, output: str) -> str:
        """Columns start..end of a matrix."""
        first = self.constant(f"{output}_start", np.array([start], np.int64))
        last = self.constant(f"{output}_end", np.array([end], np.int64))
        axis = self.constant(f"{output}_axis", np.array([1], np.int64))
        return self.node("Slice", [values, first, last, axis], output)

    def beside(self, parts: list[str], output: str) -> str:
        """Columns of several matrices side by side."""
        return self.node("Concat", parts, output, axis=1)


def _model(policy: PolicyFile, memory: Memory, contract: dict[str, Any]) -> Any:
    try:
        import onnx
        import onnx.checker
        import onnx.helper
        import onnx.numpy_helper
    except ImportError as error:
        raise missing_extra("Writing an ONNX model", "onnx", "export") from error
    graph = _Graph(onnx)
    seen = _add_memory(graph, memory) if memory.rows else "observation"
    _add_network(graph, policy, seen)
    number, truth = onnx.TensorProto.FLOAT, onnx.TensorProto.BOOL
    describe = onnx.helper.make_tensor_value_info
    inputs = [describe("observation", number, [BATCH, SIZE])]
    outputs = [describe("action", number, [BATCH, ACTIONS])]
    if memory.rows:
        inputs.append(describe("past", number, [BATCH, memory.size]))
        inputs.append(describe("first", truth, [BATCH, 1]))
        outputs.append(describe("next_past", number, [BATCH, memory.size]))
    made = onnx.helper.make_graph(graph.nodes, "policy", inputs, outputs, graph.constants)
    model = onnx.helper.make_model(
        made,
        ir_version=IR_VERSION,
        opset_imports=[onnx.helper.make_opsetid("", OPSET)],
        producer_name="robotic-fish",
        producer_version=contract["made_with"].split()[-1],
    )
    onnx.helper.set_model_props(model, {"contract": json.dumps(contract, allow_nan=False)})
    onnx.checker.check_model(model, full_check=True)
    return model


def _add_memory(graph: _Graph, memory: Memory) -> str:
    """The past as ``robofish_agents.policies.history.History`` keeps it; returns what is seen."""
    kept = memory.frames * SIZE
    repeated = graph.beside(["observation"] * memory.rows, "repeated")
    past = graph.node("Where", ["first", repeated, "past"], "known_past")
    seen, after = ["observation"], []
    if memory.frames:
        frames = graph.part(past, 0, kept, "past_frames")
        seen.append(frames)
        after.append("observation")
        if memory.frames > 1:
            after.append(graph.part(past, 0, kept - SIZE, "newer_frames"))
    if len(memory.shares):
        filters = graph.part(past, kept, memory.size, "past_filters")
        shares = graph.constant("shares", np.repeat(memory.shares, SIZE))
        wanted = graph.beside(["observation"] * len(memory.shares), "wanted")
        missing = graph.node("Sub", [wanted, filters], "missing")
        step = graph.node("Mul", [shares, missing], "filter_step")
        filtered = graph.node("Add", [filters, step], "filtered")
        seen.append(filtered)
        after.append(filtered)
    graph.beside(after, "next_past")
    return graph.beside(seen, "seen")


def _add_network(graph: _Graph, policy: PolicyFile, seen: str) -> None:
    """As :class:`robofish_agents.policies.network.Network`: stored as float, computed as double."""
    network, constant = policy.network, graph.constant
    values = graph.node("Sub", [graph.double(seen), constant("mean", network.mean)], "centred")
    values = graph.node("Div", [values, constant("scale", network.scale)], "scaled")
    limits = [constant("normal_low", -network.limit), constant("normal_high", network.limit)]
    values = graph.node("Clip", [values, *limits], "normal")
    last = len(network.weights) - 1
    for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        numbers = [constant(f"weight_{i}", weight), constant(f"bias_{i}", bias)]
        inputs = [values, *map(graph.double, numbers)]
        values = graph.node("Gemm", inputs, f"layer_{i}", transB=1)
        if i < last:
            values = graph.node(OPERATORS[network.activation], [values], f"active_{i}")
    bounds = [constant("low", -1.0), constant("high", 1.0)] if network.output == "clip" else []
    values = graph.node(OPERATORS[network.output], [values, *bounds], "bounded")
    graph.node("Cast", [values], "action", to=graph.onnx.TensorProto.FLOAT)
