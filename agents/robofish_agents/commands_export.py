"""`robofish export`: a policy as a file that other programs run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fish_env.commands.options import Json


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(export)


def export(
    policy: Annotated[
        str,
        typer.Argument(
            help="A policy file; or hold, track, path or station, for the shipped policy."
        ),
    ],
    onnx: Annotated[Path | None, typer.Option(help="ONNX model to write.")] = None,
    c: Annotated[Path | None, typer.Option("--c", help="C header to write.")] = None,
    int8: Annotated[
        bool, typer.Option("--int8", help="Store the weights of the C header with eight bits.")
    ] = False,
    config: Annotated[
        Path | None, typer.Option(help="Settings of the environment, if not in the policy's card.")
    ] = None,
    json: Json = None,
) -> None:
    """Write a policy as an ONNX model or a C header, each with its contract.

    The file contains the normalisation and the memory of past observations. The contract,
    FILE.json, gives order, units, rate and limits of all numbers.

    **Example:** `robofish export hold --onnx hold.onnx --c hold.h`
    """
    from fish_env.commands.numbers import console_for, write_json
    from robofish_agents.deployment.command import run_export

    console = console_for(json)
    written = run_export(console, policy, onnx, c, int8, config, json)
    if json is not None:
        write_json(console, json, written)
