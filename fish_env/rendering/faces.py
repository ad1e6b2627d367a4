"""What the camera sees of meshes: their faces on the picture, in the colours of light and haze."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.rendering.camera import Camera
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


def seen(meshes: Sequence[Mesh], camera: Camera) -> list[Faces]:
    """What a camera sees of each mesh; all are computed at once, numpy's calls being dear.

    Args:
        meshes: in the inertial frame.
        camera: what looks at them.
    """
    eye = camera.eye
    whole = Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
        np.concatenate([mesh.alphas for mesh in meshes]),
    )
    owners = np.repeat(np.arange(len(meshes)), [len(mesh.corners) for mesh in meshes])
    which = whole.facing(eye)
    if not which.all():
        whole, owners = whole.chosen(which), owners[which]
    middles = whole.middles
    pixels, ahead = camera.project(whole.corners)
    colours = hazed(lit(whole.colours, middles, whole.normals, eye), middles, eye)
    a, b, c, d = ahead.T
    order = np.lexsort((-((a + b + c + d) / 4.0), owners))
    together = Faces(
        pixels[order],
        np.minimum(np.minimum(a, b), np.minimum(c, d))[order],
        middles[order, 2],
        np.column_stack([colours, whole.alphas])[order].clip(0.0, 255.0).astype(np.int64),
    )
    ends = np.searchsorted(owners[order], np.arange(len(meshes) + 1))
    return [together.chosen(slice(a, b)) for a, b in pairwise(ends)]
