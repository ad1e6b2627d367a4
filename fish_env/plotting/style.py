"""The one style of all pictures, and how they are written.

Figures are drawn off screen. The palette is Okabe and Ito's, which stays apart for every kind of
colour vision; maps use cividis or viridis.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fish_env.files import check_no_links, replacing
from fish_env.version import WRITER

if TYPE_CHECKING:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE, BLACK = "#E69F00", "#56B4E9", "#CC79A7", "#222222"
PALETTE = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
MEASURED, SIMULATED = BLACK, VERMILION
COLOUR_MAP = "viridis"
FORMATS = ("png", "pdf")
DOTS_PER_INCH = 150
PALE = 0.35
"""Opacity of what lies behind a mean."""

_WRITER_KEYS = {".png": "Software", ".svg": "Creator", ".pdf": "Creator"}
"""Ending of a picture -> the entry of its metadata that names the program."""

_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.3,
    "pdf.fonttype": 42,
}


@cache
def _stamped(canvas: type[FigureCanvasAgg]) -> type[FigureCanvasAgg]:
    """A kind of canvas whose files name the version of the package."""

    class Stamped(canvas):  # type: ignore[valid-type, misc]
        def print_figure(self, filename: Any, *args: Any, **options: Any) -> Any:
            path = Path(filename) if isinstance(filename, str | Path) else Path()
            if (key := _WRITER_KEYS.get(path.suffix)) is not None:
                options["metadata"] = {key: WRITER, **(options.get("metadata") or {})}
            return super().print_figure(filename, *args, **options)

    return Stamped


@contextmanager
def drawing(width: float = 7.2, height: float = 4.0) -> Iterator[Figure]:
    """A figure in the project's style, for use with `with`.

    Args:
        width: Inches.
        height: Inches.
    """
    import matplotlib
    from cycler import cycler
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**_STYLE, "axes.prop_cycle": cycler(color=PALETTE)}):
        figure = Figure(figsize=(width, height), layout="constrained")
        _stamped(FigureCanvasAgg)(figure)
        yield figure


def colours(count: int) -> list[Any]:
    """As many colours that can be told apart: the palette, or steps of the colour map."""
    if count <= len(PALETTE):
        return list(PALETTE[:count])
    from matplotlib import colormaps

    return [colormaps[COLOUR_MAP](i / (count - 1)) for i in range(count)]


def shades(count: int) -> list[Any]:
    """Steps of the colour map, dark to light, for values that have an order."""
    from matplotlib import colormaps

    return [colormaps[COLOUR_MAP](0.85 * i / max(1, count - 1)) for i in range(count)]


def keep_literal(figure: Figure) -> None:
    """Shows a text between dollar signs that is no formula, such as a run's name, as it stands."""
    from matplotlib.mathtext import MathTextParser
    from matplotlib.text import Text

    parser = MathTextParser("agg")
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if "$" in text.get_text():
            try:
                parser.parse(text.get_text())
            except (ValueError, RecursionError):
                text.set_parse_math(False)


def files_of(
    folder: Path, names: Iterable[str], formats: Sequence[str] | None = None
) -> list[Path]:
    """The files of pictures in a folder, each in every format; default: `FORMATS`."""
    return [folder / f"{name}.{ending}" for name in names for ending in formats or FORMATS]


def save(figure: Figure, folder: Path, name: str, formats: tuple[str, ...] | None = None) -> Path:
    """Writes a figure as `<folder>/<name>.<format>` for each format; returns the first path.

    Raises:
        OutputError: A file cannot be written, or is a link.
    """
    keep_literal(figure)
    paths = files_of(folder, [name], formats)
    check_no_links(paths)
    for path in paths:
        with replacing(path) as part:
            figure.savefig(part, dpi=DOTS_PER_INCH)
    return paths[0]
