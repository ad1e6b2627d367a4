"""The fish as meshes in its body frame: hull with a window, fins, tail, and what moves inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.rendering.mesh import (
    OPAQUE,
    Mesh,
    about_x,
    about_z,
    box,
    grid_mesh,
    plate,
    tube,
)
from fish_env.rendering.shape import PEDUNCLE, FishShape, hull_profile

BACK, SIDE, BELLY = (
    np.array(colour, float) for colour in ((226, 96, 22), (255, 150, 48), (255, 232, 196))
)
FRAME, GLASS, FIN, RAIL, BLOCK, EYE, PUPIL = (
    np.array(colour, float)
    for colour in (
        (66, 72, 84),
        (186, 226, 236),
        (236, 112, 30),
        (150, 160, 170),
        (255, 214, 92),
        (246, 246, 240),
        (18, 20, 26),
    )
)
SIDES = 48
GLASS_ALPHA = 62.0
ROUNDNESS = 2.25
"""Sections of the hull are a little boxier than ellipses."""


class Fin(NamedTuple):
    """A fin on the hull: its sheet, where it stands and which way (3,), body frame."""

    mesh: Mesh
    foot: FloatArray
    outward: FloatArray


class Eye(NamedTuple):
    """An eye: its middle, which way it looks (3,), and its two half axes (2, 3), body frame."""

    middle: FloatArray
    outward: FloatArray
    axes: FloatArray


@dataclass(frozen=True)
class Fish:
    """All that is drawn of a fish, in its body frame.

    Attributes:
        shape: its sizes.
        hull: the outside of the hull without its window.
        window: the half transparent part of the hull.
        lining: the inside of the hull near the window.
        fins: on the back and on both sides.
        rail: what the weight block slides along.
        tail: at rest, its joint at the origin.
        eyes: on both sides of the nose.
    """

    shape: FishShape
    hull: Mesh
    window: Mesh
    lining: Mesh
    fins: tuple[Fin, ...]
    rail: Mesh
    tail: Mesh
    eyes: tuple[Eye, ...]

    @classmethod
    def built(cls, shape: FishShape) -> Fish:
        """The meshes of a fish."""
        hull = _hull(shape)
        glass = hull.alphas < OPAQUE
        lining = _lining(hull, shape)
        others = _fins(shape), _rail(shape), _tail(shape), _eyes(shape)
        return cls(shape, hull.chosen(~glass), hull.chosen(glass), lining, *others)

    def swung_tail(self, angle: float) -> Mesh:
        """The tail at an angle (rad), positive with the fin to port."""
        return self.tail.placed(about_z(angle), self.shape.tail_root)

    def block(self, displacement: float, angle: float) -> Mesh:
        """The weight block displaced aft (m) and swung to starboard (rad), with its crank."""
        centre = self.shape.block_centre(displacement, angle)
        block = box(self.shape.block, BLOCK).placed(about_x(-angle), centre)
        _, y, z = self.shape.block_rest
        arm = box((0.008, 0.008, self.shape.block_radius), RAIL)
        axis = np.array([centre[0], y, z])
        return block + arm.placed(about_x(-angle), (axis + centre) / 2)


def _window(shape: FishShape) -> tuple[float, float]:
    """Shares of the hull's length between which the block can be seen at work."""
    half = 0.5 * shape.block[0] + 0.016
    ends = (shape.block_rest[0] + half, shape.block_rest[0] - half)
    first, last = ((shape.nose - x) / shape.length for x in ends)
    return max(first, 0.2), min(last, 0.8)


def _stations(shape: FishShape) -> FloatArray:
    """Shares of the length where the hull has sections: dense at the nose, edges at the window."""
    first, last = _window(shape)
    edge = 0.022
    nose = first * np.linspace(0.0, 1.0, 20) ** 1.9
    frames = [first + edge, *np.linspace(first + edge, last - edge, 12)[1:-1], last - edge]
    return np.concatenate([nose, frames, np.linspace(last, 1.0, 24)])


def _hull(shape: FishShape) -> Mesh:
    along = _stations(shape)
    profile = hull_profile(along)
    slim = 1.0 - 0.25 * np.clip((along - 0.5) / 0.5, 0.0, 1.0)
    points = tube(
        shape.nose - along * shape.length,
        shape.width * profile * slim,
        shape.height * profile,
        SIDES,
        ROUNDNESS,
    )
    middle = 0.5 * (along[1:] + along[:-1])
    turn = (np.arange(SIDES) + 0.5) * 2.0 * np.pi / SIDES
    colour, alpha = _paint(middle[:, None], -np.cos(turn)[None, :], _window(shape))
    return grid_mesh(points, colour.reshape(-1, 3), alpha.reshape(-1))


def _paint(
    along: FloatArray, down: FloatArray, window: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Colours and alphas of the hull: dark back, light belly, a framed window in the middle."""
    along, down = np.broadcast_arrays(along, down)
    lower = np.clip((down + 0.05) / 0.5, 0.0, 1.0)[..., None]
    upper = np.clip((-down - 0.25) / 0.5, 0.0, 1.0)[..., None]
    colour = SIDE + upper * (BACK - SIDE) + lower * (BELLY - SIDE)
    inside = (along > window[0]) & (along < window[1])
    edge = inside & ((along < window[0] + 0.022) | (along > window[1] - 0.022))
    spine = inside & (np.abs(down) > 0.965)
    glass = inside & ~edge & ~spine
    colour = np.where((edge | spine)[..., None], FRAME, colour)
    colour = np.where(glass[..., None], GLASS, colour)
    return colour, np.where(glass, GLASS_ALPHA, OPAQUE)


def _lining(hull: Mesh, shape: FishShape) -> Mesh:
    first, last = _window(shape)
    along = (shape.nose - hull.middles[:, 0]) / shape.length
    inner = hull.chosen((along > first - 0.12) & (along < last + 0.12)).turned_over()
    clear = inner.alphas < OPAQUE
    colours = np.where(clear[:, None], GLASS * 0.55, FRAME)
    return Mesh(inner.corners, colours, np.where(clear, 60.0, OPAQUE))


def _tail(shape: FishShape) -> Mesh:
    """A tapered stem and a forked fin, one rigid piece."""
    stem_end = 0.55 * shape.tail_length
    share = np.linspace(0.0, 1.0, 6)
    thick = PEDUNCLE * 0.75 * shape.width * (1.0 - 0.75 * share)
    tall = PEDUNCLE * shape.height * (1.0 - 0.35 * share)
    stem = grid_mesh(tube(-0.011 - (stem_end - 0.011) * share, thick, tall, 14), SIDE * 0.92)
    knob = np.linspace(-1.0, 1.0, 9)
    ball = 1.04 * PEDUNCLE * np.sqrt(1.0 - 0.96 * knob**2)
    root = tube(-0.012 * knob, 0.75 * shape.width * ball, shape.height * ball, 14)
    return grid_mesh(root, FRAME) + stem + _fin(shape, 0.34 * shape.tail_length)


def _fin(shape: FishShape, start: float) -> Mesh:
    up = np.linspace(-1.0, 1.0, 25)
    half, length = 0.5 * shape.tail_span, shape.tail_length
    fork = length * (1.0 - 0.24 * (1.0 - np.abs(up) ** 1.6))
    lead = start + (length - start) * np.abs(up) ** 1.25 * 0.86
    points = np.zeros((5, len(up), 3))
    for row, share in enumerate(np.linspace(0.0, 1.0, 5)):
        points[row, :, 0] = -(lead + share * (fork - lead))
        points[row, :, 2] = half * up * (0.92 + 0.08 * share)
    rays = np.where(np.arange(len(up) - 1) % 2, 1.0, 0.88)
    fade = np.array([0.82, 0.94, 1.04, 1.12])
    colour = np.clip(FIN * (fade[:, None] * rays)[..., None], 0.0, 255.0)
    one = grid_mesh(points, colour.reshape(-1, 3))
    return one + one.turned_over()


def _fins(shape: FishShape) -> tuple[Fin, ...]:
    back = np.array([0.0, 0.0, -1.0])
    return (
        Fin(_dorsal(shape), _on_hull(shape, 0.45, back), back),
        *(_pectoral(shape, side) for side in (1.0, -1.0)),
    )


def _on_hull(shape: FishShape, along: float, direction: FloatArray) -> FloatArray:
    """Point of the hull at a share of its length, in a direction across it."""
    profile = float(hull_profile(along))
    half = 0.5 * profile * np.array([0.0, shape.width, shape.height])
    return np.array([shape.nose - along * shape.length, 0.0, 0.0]) + half * direction


def _dorsal(shape: FishShape) -> Mesh:
    share = np.linspace(0.0, 1.0, 13)
    along = 0.36 + 0.34 * share
    foot = np.stack(
        [
            shape.nose - along * shape.length,
            np.zeros_like(share),
            -0.49 * hull_profile(along) * shape.height,
        ],
        axis=1,
    )
    rise = 0.30 * shape.height * np.sin(np.pi * share**0.75) ** 0.8
    tip = foot - np.stack([0.16 * shape.length * share**0.5, 0.0 * share, rise], axis=1)
    return plate(tip, foot, FIN * np.linspace(0.85, 1.0, 12)[:, None])


def _pectoral(shape: FishShape, side: float) -> Fin:
    out = np.array([0.0, side, 0.35])
    share = np.linspace(0.0, 1.0, 9)
    before_window = _window(shape)[0] - 0.10
    root = _on_hull(shape, before_window, np.array([0.0, side * 0.84, 0.46]))
    foot = root - np.outer(share, [0.07 * shape.length, 0.0, -0.02 * shape.length])
    reach = 0.42 * shape.width * np.sin(np.pi * (0.1 + 0.75 * share))
    sweep = 0.10 * shape.length * (0.2 + share)
    tip = foot + np.stack([-sweep, side * 0.62 * reach, 0.75 * reach], axis=1)
    return Fin(plate(tip, foot, FIN * np.linspace(0.9, 1.05, 8)[:, None]), root, out)


def _rail(shape: FishShape) -> Mesh:
    """What the block slides along and swings about."""
    return box((shape.block[0] + 0.05, 0.006, 0.006), RAIL).placed(np.eye(3), shape.block_rest)


def _eyes(shape: FishShape) -> tuple[Eye, ...]:
    """The eyes on both sides of the nose."""
    found = []
    along = 0.115
    for side in (1.0, -1.0):
        outward = np.array([0.42, side * 0.86, -0.28])
        outward /= np.linalg.norm(outward)
        middle = _on_hull(shape, along, np.array([0.0, side * 0.90, -0.34]))
        first = np.cross(outward, [0.0, 0.0, 1.0])
        first /= np.linalg.norm(first)
        axes = 0.052 * shape.height * np.stack([first, np.cross(outward, first)])
        found.append(Eye(middle + 0.001 * outward, outward, axes))
    return tuple(found)
