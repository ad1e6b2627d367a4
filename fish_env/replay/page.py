"""The replay page: one file with everything in it, which opens without a network."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from fish_env.files import write_text
from fish_env.params import FishParams
from fish_env.replay.motion import Group
from fish_env.replay.packing import page_data
from fish_env.version import generator

STATIC = Path(__file__).with_name("static")
VENDOR = ("vendor/three.min.js", "vendor/uplot.min.js")
LICENCES = (("three.js", "vendor/LICENSE-three.txt"), ("uPlot", "vendor/LICENSE-uplot.txt"))
SCRIPTS = ("data.js", "fish.js", "stage.js", "plots.js", "clock.js", "keys.js", "replay.js")


def write_replay(
    groups: Sequence[Group], fish: FishParams, out: str | Path, title: str = "Replay"
) -> Path:
    """Writes a page with fish swimming in three dimensions beside linked time plots.

    Args:
        groups: What can be chosen; the motions of a group are shown together.
        fish: Its size is drawn.
        out: The HTML file.
        title: Heading of the page.

    Returns:
        The path of the file.
    """
    file = Path(out)
    page = _read("page.html")
    parts = {
        "title": html.escape(title),
        "generator": generator(),
        "style": component_style(),
        "body": component(groups, fish, whole_page=True),
        "scripts": component_scripts(),
    }
    for name, text in parts.items():
        page = page.replace(f"<!--{name}-->", text)
    write_text(file, page)
    return file


def component(
    groups: Sequence[Group], fish: FishParams, name: str = "replay", whole_page: bool = False
) -> str:
    """HTML of one replay, to be put anywhere in a page that has the style and the scripts.

    Args:
        groups: What can be chosen.
        fish: Its size is drawn.
        name: Unique in the page.
        whole_page: Keys work everywhere in the page, and it plays from the start.
    """
    # "<" could end the script element that holds the data.
    data = json.dumps(page_data(groups, fish), separators=(",", ":"), allow_nan=False)
    data = data.replace("<", "\\u003c")
    key = html.escape(name, quote=True)
    flag = ' data-whole-page="yes"' if whole_page else ""
    return (
        f'<div class="rf-replay" id="{key}" data-source="{key}-data"{flag}></div>\n'
        f'<script type="application/json" id="{key}-data">{data}</script>'
    )


@cache
def component_style() -> str:
    """The style element of all replays in a page."""
    return f"<style>\n{_read('vendor/uplot.min.css')}\n{_read('replay.css')}\n</style>"


@cache
def component_scripts() -> str:
    """The script elements of all replays in a page, with the licences of what they bring along."""
    licences = "\n".join(f"<!--\n{name}\n\n{_read(path)}-->" for name, path in LICENCES)
    scripts = "\n".join(f"<script>\n{_read(path)}\n</script>" for path in (*VENDOR, *SCRIPTS))
    return f"{licences}\n{scripts}"


def _read(path: str) -> str:
    return (STATIC / path).read_text(encoding="utf-8")
