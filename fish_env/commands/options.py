"""Options that several commands share, and what all of them do alike."""

from __future__ import annotations

import shlex
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
        help="Run the Python effect files that the fish file names. Without it they are refused.",
    ),
]
Json = Annotated[
    Path | None, typer.Option("--json", help="File for all numbers; - is standard output.")
]

OtherFish = Annotated[
    str | None, typer.Option(help="Fish to use instead of the dataset's: preset or file.")
]
Quick = Annotated[
    bool, typer.Option("--quick", help="Fit 20 s of two runs; do not compare rival causes.")
]
Patient = Annotated[
    bool,
    typer.Option("--patient", help="Search without a limit on the number of simulations."),
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
MeasuredBeats = Annotated[
    bool,
    typer.Option("--measured-beats", help="Measure tail frequencies from the hull's sway."),
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
    typer.Option(help="Number of parallel tasks on this machine.", show_default="its cores"),
]
Temp = Annotated[
    Path | None,
    typer.Option(help="Folder for Ray's own files on this machine.", show_default="Ray's"),
]


class Commands(TyperGroup):
    """The commands; a person's Ctrl-C ends each with one line."""

    _line: tuple[str, ...] = ()

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Keeps the words of the command line, for the line that tells how to start again."""
        self._line = tuple(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Runs a command.

        Raises:
            Interrupted: A person stopped it, and it did not say itself what was kept.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            again = shlex.join((str(ctx.command_path), *self._line))
            raise Interrupted(
                "stopped; files that were complete are kept, and none is half written. Start "
                f"again with: {again}"
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
