"""A controller that holds depth and heading on what the sensors say, noise and all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tests.hidden.excitation import FASTEST_STROKE, grid_of, levels

Read = Callable[[float], Mapping[str, float]]


@dataclass(frozen=True)
class Program:
    """What the controller is asked for, one value per control time.

    Attributes:
        grid: control times, s.
        depth: goal relative to the start, m.
        heading: goal relative to the start, rad.
        amplitude: tail amplitude, rad.
        frequency: tail frequency, Hz.
        turn: bracket angle, rad.
    """

    grid: np.ndarray
    depth: np.ndarray
    heading: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    turn: np.ndarray


def draw_program(rate: float, duration: float, rng: np.random.Generator) -> Program:
    """Goals that step now and then, so that the loop has to work."""
    grid = grid_of(rate, duration)

    def held(low: float, high: float, shortest: float, longest: float) -> np.ndarray:
        return levels(grid, duration, lambda: rng.uniform(low, high), shortest, longest, rng)

    frequency = held(1.0, 2.5, 4.0, 9.0)
    amplitude = np.minimum(held(0.25, 0.55, 4.0, 9.0), FASTEST_STROKE / (2 * np.pi * frequency))
    return Program(
        grid, held(-0.2, 0.2, 7.0, 12.0), held(-1.2, 1.2, 6.0, 10.0), amplitude, frequency,
        held(-0.3, 0.3, 6.0, 12.0),
    )  # fmt: skip


class Controller:
    """Depth through pitch through the block, heading through the tail offset; signs are the fish's.

    A block further aft raises the nose; a negative offset turns to starboard.
    """

    def __init__(self, program: Program, first: Mapping[str, float]) -> None:
        self.program = program
        self.origin = first["z"], first["yaw"]
        self.yaw = first["yaw"]

    def commands(self, k: int, seen: Mapping[str, float]) -> np.ndarray:
        """The row (time and five commands) at control time k."""
        program = self.program
        # The tail swings the hull at every beat, which is no error of heading.
        self.yaw += 0.3 * (seen["yaw"] - self.yaw)
        heading_error = self.origin[1] + program.heading[k] - self.yaw
        offset = -np.clip(0.6 * heading_error, -0.5, 0.5)
        depth_error = self.origin[0] + program.depth[k] - seen["z"]
        pitch = np.clip(-1.0 * depth_error, -0.2, 0.2)
        shift = pitch / 25.0 + 0.015 * (pitch - seen["pitch"]) - 0.006 * seen["q"]
        row = (
            program.grid[k],
            offset,
            program.amplitude[k],
            program.frequency[k],
            np.clip(shift, -0.009, 0.009),
            program.turn[k],
        )
        return np.round(np.array(row, float), 5)
