"""Draws a graph without circles in layers, as an SVG: every arrow points down.

The method of Sugiyama, Tagawa and Toda (1981, IEEE Trans. SMC 11, 109): layers by the longest way
down, a point of passage in each layer that an arrow crosses, and nodes sorted by the mean place of
their neighbours.
"""

from __future__ import annotations

import itertools
from html import escape

from scripts.import_graph import Graph, layers, reduced

LETTER, PADDING, HEIGHT = 7.3, 9.0, 24.0
"""Width of a letter, space beside a name, height of a box (px)."""
PASSAGE, GAP, RISE, MARGIN = 8.0, 16.0, 64.0, 12.0
"""Width of a point of passage, space between boxes, between layers, around all (px)."""
SWEEPS = 24
STYLE = (
    "text{font:12px monospace;text-anchor:middle;fill:#1b2a33}"
    "rect.box{fill:#e3f1f4;stroke:#2f7d8c}path{fill:none;stroke:#5a6b75;stroke-opacity:.65}"
)

Place = tuple[str, str, int]
"""A node, or the passage of an arrow from a node to another through a layer."""


def drawing(graph: Graph, title: str) -> str:
    """An SVG of a graph, without the arrows that follow from others.

    Args:
        graph: a graph without circles.
        title: what it shows, for who cannot see it.
    """
    arrows = reduced(graph)
    rows, ways = _routed(arrows)
    rows = _untangled(rows, ways)
    at, width = _placed(rows)
    height = 2 * MARGIN + HEIGHT + RISE * (len(rows) - 1)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" role="img">',
        f"<title>{escape(title)}</title><style>{STYLE}</style>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#fff"/>',
        *(_curve(way, at) for way in ways),
    ]
    for row in rows:
        parts += [_box(place, *at[place]) for place in row if not place[1]]
    return "\n".join([*parts, "</svg>"]) + "\n"


def _routed(arrows: Graph) -> tuple[list[list[Place]], list[list[Place]]]:
    """Layers from the top, with points of passage, and each arrow as the places it goes through."""
    names = layers(arrows)
    level = {name: i for i, row in enumerate(names) for name in row}
    rows: list[list[Place]] = [[(name, "", i) for name in row] for i, row in enumerate(names)]
    ways = []
    for name, others in arrows.items():
        for other in sorted(others):
            passed = [(name, other, i) for i in range(level[name] - 1, level[other], -1)]
            for place in passed:
                rows[place[2]].append(place)
            ways.append([(name, "", level[name]), *passed, (other, "", level[other])])
    return rows[::-1], ways


def _untangled(rows: list[list[Place]], ways: list[list[Place]]) -> list[list[Place]]:
    """Layers sorted, in sweeps down and up, by where the neighbours of each place stand."""
    above: dict[Place, list[Place]] = {}
    below: dict[Place, list[Place]] = {}
    for way in ways:
        for high, low in itertools.pairwise(way):
            below.setdefault(high, []).append(low)
            above.setdefault(low, []).append(high)
    best, fewest = rows, _crossings(rows, below)
    for sweep in range(SWEEPS):
        neighbours, order = (above, rows) if sweep % 2 == 0 else (below, rows[::-1])
        done = [order[0]]
        for row in order[1:]:
            centre = {place: i / len(done[-1]) for i, place in enumerate(done[-1])}
            own = {place: i / len(row) for i, place in enumerate(row)}
            key = {
                place: _mean([centre[n] for n in neighbours.get(place, []) if n in centre])
                for place in row
            }
            done.append(sorted(row, key=lambda p: own[p] if key[p] is None else key[p]))
        rows = done if sweep % 2 == 0 else done[::-1]
        crossings = _crossings(rows, below)
        if crossings < fewest:
            best, fewest = rows, crossings
    return best


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _crossings(rows: list[list[Place]], below: dict[Place, list[Place]]) -> int:
    """How many pairs of arrows cross."""
    total = 0
    for high, low in itertools.pairwise(rows):
        place = {p: i for i, p in enumerate(low)}
        ends = [(i, place[n]) for i, p in enumerate(high) for n in below.get(p, [])]
        total += sum(
            (a[0] - b[0]) * (a[1] - b[1]) < 0 for k, a in enumerate(ends) for b in ends[:k]
        )
    return total


def _width(place: Place) -> float:
    return PASSAGE if place[1] else LETTER * len(place[0]) + 2 * PADDING


def _placed(rows: list[list[Place]]) -> tuple[dict[Place, tuple[float, float]], float]:
    """Middle of each place (px), every layer in the middle of the picture, and its width."""
    widths = [sum(map(_width, row)) + GAP * (len(row) - 1) for row in rows]
    whole = max(widths) + 2 * MARGIN
    at = {}
    for i, (row, width) in enumerate(zip(rows, widths, strict=True)):
        x = 0.5 * (whole - width)
        for place in row:
            at[place] = (x + 0.5 * _width(place), MARGIN + 0.5 * HEIGHT + RISE * i)
            x += _width(place) + GAP
    return at, whole


def _curve(way: list[Place], at: dict[Place, tuple[float, float]]) -> str:
    """An arrow as smooth curves from layer to layer."""
    (x, y), text = at[way[0]], ""
    y += 0.5 * HEIGHT
    text = f"M{x:.0f} {y:.0f}"
    for place in way[1:]:
        right, low = at[place]
        top = low - 0.5 * HEIGHT
        half = 0.5 * (y + top)
        text += f"C{x:.0f} {half:.0f} {right:.0f} {half:.0f} {right:.0f} {top:.0f}"
        x, y = right, top
        if place[1]:
            y = low + 0.5 * HEIGHT
            text += f"V{y:.0f}"
    return f'<path d="{text}"/>'


def _box(place: Place, x: float, y: float) -> str:
    width = _width(place)
    return (
        f'<rect class="box" x="{x - 0.5 * width:.1f}" y="{y - 0.5 * HEIGHT:.1f}" '
        f'width="{width:.1f}" height="{HEIGHT:.0f}" rx="4"/>'
        f'<text x="{x:.1f}" y="{y + 4:.1f}">{escape(place[0])}</text>'
    )
