"""The command ``robofish train``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fish_env.commands.options import TrustEffects


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
) -> None:
    """Train a policy with Stable-Baselines3 or Ray RLlib.

    Writes `policy.npz`, which runs without PyTorch, its `card.yaml`, checkpoints, evaluations and
    a TensorBoard log. After a stop, `--resume` continues to the same result.
    Files in the folder that a training did not write are never replaced.

    **Example:** `robofish train ppo-hold`
    """
    from rich.console import Console

    from robofish_agents.training.command import run

    run(Console(), config, out, seed, steps, resume, trust_effects, engine)


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(train)
