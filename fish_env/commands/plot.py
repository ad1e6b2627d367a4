"""`robofish plot`: the pictures that papers need, of any fish."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

from fish_env.errors import ConfigError
from fish_env.files import check_chosen
from fish_env.params import FishParams, load_fish
from fish_env.plotting.style import files_of

Formats = tuple[str, ...]
FORMATS = ("png", "svg", "pdf")


def motions(fish: FishParams, folder: Path, formats: Formats) -> Path:
    """The four motions of the paper from rest."""
    from fish_env.plotting.motions import draw_motions
    from fish_env.studies.curves import four_motions

    return draw_motions(four_motions(fish), folder, formats)


def polar(fish: FishParams, folder: Path, formats: Formats) -> Path:
    """Steady speed and turning rate over offset, frequency and amplitude of the tail."""
    from fish_env.plotting.polar import draw_polar
    from fish_env.studies.curves import polars

    return draw_polar(polars(fish), fish.name, folder, formats)


def forces(fish: FishParams, folder: Path, formats: Formats) -> Path:
    """Forces and moments of every term of the model over one beat of the tail."""
    from fish_env.plotting.forces import draw_forces
    from fish_env.studies.curves import breakdown

    return draw_forces(breakdown(fish), folder, formats)


def trim(fish: FishParams, folder: Path, formats: Formats) -> Path:
    """Pitch, roll and depth rate over the place of the weight block."""
    from fish_env.plotting.trim import draw_trim
    from fish_env.studies.curves import AMPLITUDE, trim_curves

    title = f"{fish.name}, tail amplitude {np.degrees(AMPLITUDE):.0f} deg"
    return draw_trim(*trim_curves(fish), title, folder, formats)


KINDS: dict[str, Callable[[FishParams, Path, Formats], Path]] = {
    "motions": motions,
    "polar": polar,
    "forces": forces,
    "trim": trim,
}


def plot_fish(
    console: Console,
    kind: str,
    fish: str,
    out: Path,
    formats: list[str],
    trust_effects: bool = False,
) -> list[Path]:
    """Draws one kind of picture, or all, and names the files.

    Args:
        console: Where progress and names go.
        kind: One of `KINDS`, or `all`.
        fish: A preset's name, or a parameter file.
        out: Folder for the pictures.
        formats: Some of `FORMATS`.
        trust_effects: Run the effect files that the fish's file names.

    Returns:
        The first format of each picture.

    Raises:
        ConfigError: An unknown kind or format.
        ParameterError: The fish cannot be used.
        OutputError: A picture cannot be written, is a link, or would replace a file that this
            program did not write.
    """
    if kind not in (*KINDS, "all"):
        raise ConfigError(f"no picture '{kind}': choose {', '.join(KINDS)} or all")
    unknown = sorted(set(formats) - set(FORMATS))
    if unknown:
        raise ConfigError(f"no format '{unknown[0]}': choose from {', '.join(FORMATS)}")
    loaded = load_fish(fish, trust_effects)
    names = list(KINDS) if kind == "all" else [kind]
    check_chosen(files_of(out, names, formats))
    written = []
    for name in names:
        with console.status(f"swimming and drawing: {name}"):
            written.append(KINDS[name](loaded, out, tuple(formats)))
        for ending in formats:
            console.print(str(written[-1].with_suffix(f".{ending}")), soft_wrap=True)
    return written
