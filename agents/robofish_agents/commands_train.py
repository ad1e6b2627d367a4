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
    seed: Annotated[int | None, typer.Option(help="Another seed than the file's.")] = None,
    steps: Annotated[int | None, typer.Option(help="Another number of steps.")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the training in the folder.")
    ] = False,
    trust_effects: TrustEffects = False,
) -> None:
    """Train a policy with Stable-Baselines3.

    Leaves `policy.npz`, which swims without PyTorch, its `card.yaml`, checkpoints, evaluations and
    a TensorBoard log. After a stop, `--resume` goes on as if nothing had happened.
    Files in the folder that a training did not write are never replaced.

    **Example:** `robofish train ppo-hold`
    """
    from rich.console import Console

    from robofish_agents.training.command import run

    run(Console(), config, out, seed, steps, resume, trust_effects)


def register(app: typer.Typer) -> None:
    """Adds the command to `robofish`."""
    app.command()(train)
