"""The command ``robofish train``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from fish_env.commands.options import Json, TrustEffects


def train(
    config: Annotated[str, typer.Argument(help="A YAML file, or a shipped training's name.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: out/train/NAME-seed-SEED.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed, instead of the file's.")] = None,
    steps: Annotated[
        int | None, typer.Option(help="Number of steps, instead of the file's.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the training in the folder.")
    ] = False,
    trust_effects: TrustEffects = False,
    engine: Annotated[
        str | None,
        typer.Option(
            help="Library that learns, instead of the file's: sb3 (Stable-Baselines3) or rllib "
            "(Ray RLlib).",
            show_default=False,
        ),
    ] = None,
    json: Json = None,
) -> None:
    """Train a policy with Stable-Baselines3 or Ray RLlib.

    Writes `policy.npz`, which runs without PyTorch, its `card.yaml`, checkpoints, evaluations and
    a TensorBoard log. After a stop, `--resume` continues to the same result.
    Files in the folder that a training did not write are never replaced.

    **Example:** `robofish train ppo-hold`
    """
    from fish_env.commands.numbers import console_for, write_json
    from robofish_agents.training.command import run

    console = console_for(json)
    outcome = run(console, config, out, seed, steps, resume, trust_effects, engine, json)
    if json is not None:
        found = {"policy": str(outcome.policy), "best": outcome.best}
        write_json(console, json, {**found, **asdict(outcome.progress)})


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(train)
