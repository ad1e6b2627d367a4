"""What the camera sees of straight lines in the water."""

from __future__ import annotations

from typing import Any

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.model.jit import entry_point_of_file, kernel
from fish_env.rendering.camera import NEAR
from fish_env.rendering.light import Colour, faded, left_at


@kernel
def seen_from(tips: FloatArray, view: FloatArray, i: int) -> Any:
    """One inertial coordinate of the middle of a line, from the eye (m)."""
    return 0.5 * (
        (tips[0, 0] + tips[1, 0]) * view[1, i]
        + (tips[0, 1] + tips[1, 1]) * view[2, i]
        + (tips[0, 2] + tips[1, 2]) * view[3, i]
    )


@entry_point_of_file
def see_lines(
    ends: FloatArray,
    paint: FloatArray,
    view: FloatArray,
    frame: FloatArray,
    ground: Colour,
    pixels: FloatArray,
    colours: IntArray,
) -> int:
    """Find the lines that are in the picture, and what they look like; returns how many.

    They are cut off where they come too near to the eye.

    Args:
        ends: (n, 2, 3) where they begin and end (m).
        paint: (n, 5) their colours, how much of them is left (0 to 1), and widths (m).
        view: (4, 3) eye, axes of the camera.
        frame: (5,) scale of the camera, width and height of the picture, least width of a line
            (pixels), and how little of a colour may be left of lines that are drawn.
        ground: what faint ones fade to; negative: the water.
        pixels: (n, 5) beginning, end, and width on the picture, filled in from the start.
        colours: (n, 3) as seen, likewise.
    """
    count = 0
    tips = np.empty((2, 3))
    for n in range(len(ends)):
        for i in range(2):
            x, y, z = (
                ends[n, i, 0] - view[0, 0],
                ends[n, i, 1] - view[0, 1],
                ends[n, i, 2] - view[0, 2],
            )
            for k in range(3):
                tips[i, k] = x * view[1 + k, 0] + y * view[1 + k, 1] + z * view[1 + k, 2]
        if not max(tips[0, 0], tips[1, 0]) > NEAR:
            continue
        if paint[n, 3] * left_at(abs(0.5 * (tips[0, 0] + tips[1, 0]))) <= frame[4]:
            continue
        nearer = 0 if tips[0, 0] < tips[1, 0] else 1
        if tips[nearer, 0] < NEAR:
            span = tips[1 - nearer, 0] - tips[nearer, 0]
            share = (NEAR - tips[nearer, 0]) / span
            for k in range(3):
                tips[nearer, k] += share * (tips[1 - nearer, k] - tips[nearer, k])
        thick = max(float(round(frame[0] * paint[n, 4] / tips[0, 0])), frame[3])
        beside = False
        for k in range(2):
            place = tips[0, 1 + k] * (frame[0] / tips[0, 0]) + 0.5 * frame[1 + k]
            other = tips[1, 1 + k] * (frame[0] / tips[1, 0]) + 0.5 * frame[1 + k]
            pixels[count, k], pixels[count, 2 + k] = place, other
            beside = beside or max(place, other) <= -thick - 2.0
            beside = beside or min(place, other) >= frame[1 + k] + thick + 2.0
        if beside:
            continue
        pixels[count, 4] = thick
        ray = (seen_from(tips, view, 0), seen_from(tips, view, 1), seen_from(tips, view, 2))
        own = paint[n, 0], paint[n, 1], paint[n, 2]
        shade = faded(own, paint[n, 3], ground, ray)
        for k in range(3):
            colours[count, k] = int(max(0.0, min(255.0, shade[k])))
        count += 1
    return count
