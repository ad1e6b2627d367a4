"""The fish of a scene with the way it came, in the order in which its parts cover each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fish_env.arrays import BoolArray, FloatArray
from fish_env.model.frames import rotation
from fish_env.model.jit import py_function
from fish_env.rendering import markers
from fish_env.rendering.body import EYE, PUPIL, Fish
from fish_env.rendering.canvas import Canvas
from fish_env.rendering.faces import Faces, Pose, seen
from fish_env.rendering.mesh import Mesh
from fish_env.rendering.scene import Scene
from fish_env.rendering.shape import hull_profile

CIRCLE = np.linspace(0.0, 2.0 * np.pi, 17)[:-1]


@dataclass(frozen=True)
class Side:
    """What lies above or below a depth."""

    depth: float
    above: bool

    def holds(self, points: FloatArray) -> BoolArray:
        """Which of the points (n, 3) lie on this side; (n,)."""
        return self.has(points[:, 2])

    def has(self, depths: FloatArray) -> BoolArray:
        """Which depths (n,) lie on this side (m); (n,)."""
        return np.asarray((depths < self.depth) == self.above)

    @property
    def other(self) -> Side:
        """The rest of the water."""
        return Side(self.depth, not self.above)


class Swimmer:
    """One fish, placed where a scene has it.

    Attributes:
        scene: the moment.
        rotation: (3, 3) takes body vectors to the inertial frame.
    """

    def __init__(self, canvas: Canvas, fish: Fish, scene: Scene) -> None:
        self.canvas = canvas
        self.scene = scene
        self.shape = fish.shape
        unit = scene.quaternion / np.linalg.norm(scene.quaternion)
        self.rotation = np.array(py_function(rotation)(*unit)).reshape(3, 3)
        self.eye = self.rotation.T @ (canvas.camera.eye - scene.position)
        self._eyes = fish.eyes
        behind, before = self._outer_parts(fish)
        block = fish.block(float(scene.actuators[3]), float(scene.actuators[4]))
        hull = [fish.lining, fish.rail, block, fish.window, fish.hull]
        parts = [*behind, *hull, *before]
        faces = seen(parts, Pose(self.rotation, scene.position), canvas.camera)
        covered = len(parts) - len(before)
        self._behind, self._before = faces[:covered], faces[covered:]
        self._wake = markers.wake_points(
            scene, 1.15 * self.shape.tail_length - fish.shape.tail_root[0]
        )

    def at(self, body: FloatArray) -> FloatArray:
        """Inertial points (..., 3) of body points."""
        return np.asarray(body @ self.rotation.T + self.scene.position)

    def _outer_parts(self, fish: Fish) -> tuple[list[Mesh], list[Mesh]]:
        """Tail and fins: those that the hull may cover, and those that may cover it."""
        behind: list[Mesh] = []
        before: list[Mesh] = []
        for mesh, foot, outward in fish.fins:
            (before if (self.eye - foot) @ outward > 0.0 else behind).append(mesh)
        tail_in_front = self.eye[0] < self.shape.tail_root[0]
        (before if tail_in_front else behind).append(fish.swung_tail(self.scene.tail_angle))
        return behind, before

    def draw(self, side: Side | None = None) -> None:
        """Draw all, or what of it lies on one side of a depth."""
        middles = 0.5 * (self._wake[1:] + self._wake[:-1])
        camera = self.canvas.camera
        farther = camera.seen(middles)[:, 0] > camera.seen(self.scene.position)[0]
        chosen = np.ones(len(middles), bool) if side is None else side.holds(middles)
        markers.draw_wake(self.canvas, self._wake, chosen & farther)
        for faces in self._behind:
            self._draw(faces, side)
        self._draw_eyes(side)
        for faces in self._before:
            self._draw(faces, side)
        markers.draw_wake(self.canvas, self._wake, chosen & ~farther)

    def _draw(self, faces: Faces, side: Side | None) -> None:
        if side is not None:
            chosen = side.has(faces.depths)
            if not chosen.any():
                return
            faces = faces if chosen.all() else faces.chosen(chosen)
        self.canvas.faces(faces)

    def _draw_eyes(self, side: Side | None) -> None:
        circle = np.stack([np.cos(CIRCLE), np.sin(CIRCLE)], axis=1)
        for middle, outward, axes in self._eyes:
            at = self.at(middle)
            if (self.eye - middle) @ outward < 0.0 or (side and not side.holds(at[None])[0]):
                continue
            shades = self.canvas.faded(np.array([EYE, PUPIL]), np.stack([at, at]))
            for shade, size in zip(shades, (1.0, 0.62), strict=True):
                self.canvas.polygon(self.at(middle + size * circle @ axes), shade)

    def outline(self) -> FloatArray:
        """(n, 3) points around the hull and the tail, at their widest (m, inertial)."""
        along = np.linspace(0.0, 1.0, 14)
        half = 0.5 * self.shape.width * hull_profile(along)
        x = self.shape.nose - along * self.shape.length
        port = np.column_stack([x, -half, np.zeros_like(x)])
        starboard = np.column_stack([x, half, np.zeros_like(x)])[::-1]
        angle = self.scene.tail_angle
        fin = self.shape.tail_length * np.array([np.cos(angle), np.sin(angle), 0.0])
        return self.at(np.vstack([port, np.array(self.shape.tail_root) - fin, starboard]))
