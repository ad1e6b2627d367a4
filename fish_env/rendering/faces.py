"""What the camera sees of meshes: their faces on the picture, in the colours of light and haze."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.model.jit import entry_point_of_file
from fish_env.rendering.camera import NEAR, Camera
from fish_env.rendering.light import hazed, lit
from fish_env.rendering.mesh import Mesh


@dataclass(frozen=True)
class Faces:
    """Faces of one mesh that look at the eye, the farthest first.

    Attributes:
        pixels: (n, 4, 2) corners on the picture.
        nearest: (n,) distance ahead of the nearest corner (m).
        depths: (n,) depth in the water of the middle (m).
        colours: (n, 4) as seen, with alphas, 0 to 255.
    """

    pixels: FloatArray
    nearest: FloatArray
    depths: FloatArray
    colours: IntArray

    def chosen(self, which: BoolArray | slice) -> Faces:
        """Some of the faces; which: (n,)."""
        return Faces(
            self.pixels[which], self.nearest[which], self.depths[which], self.colours[which]
        )


@dataclass(frozen=True)
class Pose:
    """Where a body is: its rotation (3, 3) takes body vectors to the inertial frame; m."""

    rotation: FloatArray
    position: FloatArray


def seen(meshes: Sequence[Mesh], pose: Pose, camera: Camera) -> list[Faces]:
    """What a camera sees of each mesh; all are computed at once, numpy's calls being dear.

    Args:
        meshes: in the body frame.
        pose: of the body.
        camera: what looks at them.
    """
    corners = np.concatenate([mesh.corners for mesh in meshes])
    paint = np.concatenate([mesh.painted for mesh in meshes])
    sizes = [len(mesh.corners) for mesh in meshes]
    view = np.vstack([pose.rotation, pose.position, camera.eye, camera.axes])
    frame = np.array([camera.scale, 0.5 * camera.width, 0.5 * camera.height])
    pixels, places = np.empty((len(corners), 4, 2)), np.empty((len(corners), 3))
    colours, which = np.empty((len(corners), 4), np.int64), np.empty(len(corners), np.int64)
    count = see_faces(corners, paint, view, frame, pixels, places, colours, which)
    owners = np.repeat(np.arange(len(meshes)), sizes)[which[:count]]
    order = np.lexsort((-places[:count, 0], owners))
    together = Faces(pixels[order], places[order, 1], places[order, 2], colours[order])
    ends = np.searchsorted(owners, np.arange(len(meshes) + 1))
    return [together.chosen(slice(a, b)) for a, b in pairwise(ends)]


@entry_point_of_file
def see_faces(
    corners: FloatArray,
    paint: FloatArray,
    view: FloatArray,
    frame: FloatArray,
    pixels: FloatArray,
    places: FloatArray,
    colours: IntArray,
    which: IntArray,
) -> int:
    """Find the faces that look at the eye, and what they look like; returns how many.

    Args:
        corners: (n, 4, 3) of faces in the body frame (m).
        paint: (n, 4) their colours in white light and alphas, 0 to 255.
        view: (8, 3) rotation and position of the body, eye, axes of the camera.
        frame: (3,) scale of the camera, middle of the picture.
        pixels: (n, 4, 2) corners on the picture, filled in from the start.
        places: (n, 3) mean distance ahead, least distance ahead, depth (m), likewise.
        colours: (n, 4) as seen, with alphas, likewise.
        which: (n,) their numbers, likewise.
    """
    count = 0
    points = np.empty((4, 3))
    for n in range(len(corners)):
        for i in range(4):
            for k in range(3):
                points[i, k] = (
                    view[k, 0] * corners[n, i, 0]
                    + view[k, 1] * corners[n, i, 1]
                    + view[k, 2] * corners[n, i, 2]
                    + view[3, k]
                )
        ax, bx = points[2, 0] - points[0, 0], points[3, 0] - points[1, 0]
        ay, by = points[2, 1] - points[0, 1], points[3, 1] - points[1, 1]
        az, bz = points[2, 2] - points[0, 2], points[3, 2] - points[1, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        middle = (points[0, 2] + points[1, 2] + points[2, 2] + points[3, 2]) / 4.0
        ex = view[4, 0] - (points[0, 0] + points[1, 0] + points[2, 0] + points[3, 0]) / 4.0
        ey = view[4, 1] - (points[0, 1] + points[1, 1] + points[2, 1] + points[3, 1]) / 4.0
        ez = view[4, 2] - middle
        # Not by way of the planes' distances: a sheet seen edge-on would then flicker.
        if not x * ex + y * ey + z * ez > 0.0:
            continue
        length = max(math.sqrt(x * x + y * y + z * z), 1e-12)
        own = paint[n, 0], paint[n, 1], paint[n, 2]
        bright = lit(own, (x / length, y / length, z / length), (ex, ey, ez))
        shade = hazed(bright, (-ex, -ey, -ez))
        mean, nearest = 0.0, math.inf
        for i in range(4):
            dx, dy, dz = (
                points[i, 0] - view[4, 0],
                points[i, 1] - view[4, 1],
                points[i, 2] - view[4, 2],
            )
            ahead = dx * view[5, 0] + dy * view[5, 1] + dz * view[5, 2]
            factor = frame[0] / max(ahead, NEAR)
            for k in range(2):
                across = dx * view[6 + k, 0] + dy * view[6 + k, 1] + dz * view[6 + k, 2]
                pixels[count, i, k] = across * factor + frame[1 + k]
            mean, nearest = mean + 0.25 * ahead, min(nearest, ahead)
        places[count, 0], places[count, 1], places[count, 2] = mean, nearest, middle
        for k in range(3):
            colours[count, k] = int(max(0.0, min(255.0, shade[k])))
        colours[count, 3] = int(paint[n, 3])
        which[count] = n
        count += 1
    return count
