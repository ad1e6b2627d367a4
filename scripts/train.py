"""Trains a policy: the same as ``robofish train``."""

from __future__ import annotations

import typer

from fish_env.errors import RoboticFishError
from robofish_agents.commands_train import train


def main() -> None:
    try:
        typer.run(train)
    except RoboticFishError as error:
        raise SystemExit(f"train: {error}") from None


if __name__ == "__main__":
    main()
