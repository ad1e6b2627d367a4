"""Implementation of `robofish export`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from fish_env.envs.tasks import TASKS
from fish_env.errors import ConfigError
from fish_env.files import STANDARD, check_outputs
from robofish_agents.deployment.c_header import export_c
from robofish_agents.deployment.contract import contract_path
from robofish_agents.deployment.onnx_model import export_onnx
from robofish_agents.policies import read_policy, shipped


def run_export(
    console: Console,
    policy: str,
    onnx: Path | None,
    c: Path | None,
    int8: bool,
    config: Path | None,
    json: Path | None,
) -> dict[str, Any]:
    """Exports a policy, and prints the files that were written.

    Args:
        console: where the files are named.
        policy: a policy file, or a task whose first shipped policy is meant.
        onnx: the model to write.
        c: the header to write.
        int8: the header gets weights of eight bits.
        config: settings of the environment.
        json: where the caller will write what this returns.

    Returns:
        ``policy``, and ``files`` with the name and the bytes of each.

    Raises:
        ConfigError: nothing to write, no such policy, or settings that do not fit it.
        MissingExtraError: an ONNX model is wanted, and the package onnx is not installed.
        OutputError: a file cannot be written, or would replace one that is read.
    """
    if onnx is None and c is None:
        raise ConfigError("nothing to write: name a file with --onnx FILE or --c FILE")
    if int8 and c is None:
        raise ConfigError("--int8 is for the C header: name it with --c FILE")
    outputs = [path for path in (onnx, c) if path is not None]
    if any(str(path) == STANDARD for path in outputs):
        raise ConfigError("an export has two files; give it a name in place of -")
    file = shipped(policy)[0] if policy in TASKS and not Path(policy).is_file() else Path(policy)
    if not file.exists():
        raise ConfigError(
            f"{policy}: no such policy file. Give the path of a policy.npz, or the task of a "
            f"shipped policy: {', '.join(TASKS)}"
        )
    contracts = [contract_path(path) for path in outputs]
    check_outputs([*outputs, *contracts, json], [file, config])
    read = read_policy(file)
    written: list[Path] = []
    if onnx is not None:
        written += export_onnx(read, onnx, config)
    if c is not None:
        written += export_c(read, c, config, int8)
    sizes = {str(path): path.stat().st_size for path in written}
    for path, size in sizes.items():
        console.print(f"written: {path} ({size:,} bytes)", soft_wrap=True, markup=False)
    return {"policy": str(file), "files": [{"file": k, "bytes": v} for k, v in sizes.items()]}
