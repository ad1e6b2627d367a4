"""Options that several commands share, and what all of them do alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from fish_env.errors import Interrupted
from fish_env.version import VERSION

DISTRIBUTION = "robotic-fish"

TrustEffects = Annotated[
    bool,
    typer.Option(
        "--trust-effects",
        help="Run the Python files of effects that the fish's file names. Reading runs no code.",
    ),
]
Json = Annotated[
    Path | None, typer.Option("--json", help="File for all numbers; - is standard output.")
]

OtherFish = Annotated[
    str | None, typer.Option(help="Another fish than the dataset names: preset or file.")
]
Quick = Annotated[
    bool, typer.Option("--quick", help="Fit 20 s of two runs; compare no rival causes.")
]
Seed = Annotated[int, typer.Option(min=0, help="Of all that is random.")]
MeasuredBeats = Annotated[
    bool,
    typer.Option("--measured-beats", help="Take tail frequencies from the hull's sway."),
]
Address = Annotated[
    str | None,
    typer.Option(
        help="A running Ray cluster, HOST:PORT or auto. Without it, Ray starts on this machine "
        "and ends with the command.",
        show_default=False,
    ),
]
Cpus = Annotated[
    int | None,
    typer.Option(help="Tasks side by side on this machine.", show_default="its cores"),
]
Temp = Annotated[
    Path | None,
    typer.Option(help="Folder for Ray's own files on this machine.", show_default="Ray's"),
]


class Commands(TyperGroup):
    """The commands; a person's Ctrl-C ends each with one line."""

    def invoke(self, ctx: Any) -> Any:
        """Runs a command.

        Raises:
            Interrupted: A person stopped it, and it did not say itself what was kept.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted(
                "stopped; files that were complete stay, nothing is half written. Start again to "
                "get the rest"
            ) from None


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"{DISTRIBUTION} {VERSION}")
        raise typer.Exit


Version = Annotated[
    bool,
    typer.Option(
        "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
    ),
]
