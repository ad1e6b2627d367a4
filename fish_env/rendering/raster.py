"""Compiled drawing: polygons on the numbers of a surface, and a picture at half its size.

A polygon covers every pixel that its outline touches along the middle of a row, so that a plate
seen edge-on stays a line. Rows that it touches less than half are sampled at its tip.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pygame

from fish_env.arrays import FloatArray, IntArray
from fish_env.model.jit import entry_point_of_file, kernel

Packed = npt.NDArray[np.uint32]
"""(height, width) pixels of a surface of the drawing library, each one number."""


def numbers(surface: pygame.Surface) -> Packed:
    """(height, width) pixels of a surface, each one number; locks it while they are held."""
    return np.asarray(pygame.surfarray.pixels2d(surface).T.view(np.uint32))


def shrunk(surface: pygame.Surface, size: tuple[int, int]) -> pygame.Surface:
    """A surface at a smaller size; a half of it, the usual one, is compiled here."""
    if surface.get_size() != (2 * size[0], 2 * size[1]):
        return pygame.transform.smoothscale(surface, size)
    small = pygame.Surface(size, 0, surface)
    halve(numbers(surface), numbers(small))
    return small


@kernel
def blended(below: Any, colour: Any, share: Any) -> Any:
    """One pixel with a colour over it, whose share is 0 to 256; two bytes are mixed at once."""
    some, rest = np.uint32(0x00FF00FF), np.uint32(256) - share
    half, eight = np.uint32(0x00800080), np.uint32(8)
    even = ((colour & some) * share + (below & some) * rest + half) >> eight
    odd = ((colour >> eight) & some) * share + ((below >> eight) & some) * rest + half
    return (even & some) | (odd & ~some)


@entry_point_of_file
def fill(pixels: Packed, outlines: FloatArray, colours: IntArray, alphas: IntArray) -> None:
    """Fill polygons, the first of them first; where sides cross, every second part.

    Args:
        pixels: (height, width), changed in place.
        outlines: (n, corners, 2) on the picture.
        colours: (n,) packed as the pixels are.
        alphas: (n,) 0 to 255; 255 replaces what is there.
    """
    height, width = pixels.shape
    corners = outlines.shape[1]
    hits = np.empty(max(corners, 2))
    for n in range(len(outlines)):
        left, right = outlines[n, 0, 0], outlines[n, 0, 0]
        top, bottom = outlines[n, 0, 1], outlines[n, 0, 1]
        for i in range(1, corners):
            left, right = min(left, outlines[n, i, 0]), max(right, outlines[n, i, 0])
            top, bottom = min(top, outlines[n, i, 1]), max(bottom, outlines[n, i, 1])
        if not (right >= 0.0 and left < width and bottom >= 0.0 and top < height):
            continue
        colour, share = np.uint32(colours[n]), np.uint32(alphas[n] + (alphas[n] >> 7))
        inside = 1e-6 * (bottom - top)
        for row in range(int(max(top, 0.0)), int(min(bottom, height - 1.0)) + 1):
            level = min(max(row + 0.5, top + inside), bottom - inside)
            count = 0
            for i in range(corners):
                x, y = outlines[n, i - 1, 0], outlines[n, i - 1, 1]
                other_x, other_y = outlines[n, i, 0], outlines[n, i, 1]
                if (y <= level) != (other_y <= level):
                    hit = x + (level - y) * (other_x - x) / (other_y - y)
                    place = count
                    while place > 0 and hits[place - 1] > hit:
                        hits[place] = hits[place - 1]
                        place -= 1
                    hits[place] = hit
                    count += 1
            if count < 2:  # as low as a line
                hits[0], hits[1], count = left, right, 2
            for i in range(0, count - 1, 2):
                if hits[i + 1] < 0.0 or hits[i] >= width:
                    continue
                first, last = int(max(hits[i], 0.0)), int(min(hits[i + 1], width - 1.0))
                line = pixels[row, first : last + 1]
                if share >= 256:
                    for x in range(len(line)):
                        line[x] = colour
                else:
                    for x in range(len(line)):
                        line[x] = blended(line[x], colour, share)


@entry_point_of_file
def halve(large: Packed, small: Packed) -> None:
    """Shrink a picture to half its width and height: means of two pixels, then of two rows.

    Both round down, as the drawing library does.

    Args:
        large: (2 * height, 2 * width).
        small: (height, width), filled in.
    """
    height, width = small.shape
    most = np.uint32(0xFEFEFEFE)
    one = np.uint32(1)
    for row in range(height):
        for column in range(width):
            a, b = large[2 * row, 2 * column], large[2 * row, 2 * column + 1]
            upper = (a & b) + (((a ^ b) & most) >> one)
            c, d = large[2 * row + 1, 2 * column], large[2 * row + 1, 2 * column + 1]
            lower = (c & d) + (((c ^ d) & most) >> one)
            small[row, column] = (upper & lower) + (((upper ^ lower) & most) >> one)
