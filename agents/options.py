"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

TrustEffects = Annotated[
    bool,
    typer.Option(
        "--trust-effects",
        help="Run the Python files of effects that the fish's file names. Reading runs no code.",
    ),
]
