"""Command schedules, each shape (n, 6): time and the five commands, rows on the sample grid."""

from __future__ import annotations

import numpy as np

FASTEST_STROKE = 7.0
"""rad/s. Largest A1 2 pi f1 that is asked for; a good servo's limit is 8 to 10."""


def holds(duration: float, shortest: float, longest: float, rng: np.random.Generator) -> np.ndarray:
    """Start times of stretches of random length that fill the run."""
    times = [0.0]
    while times[-1] < duration:
        times.append(times[-1] + rng.uniform(shortest, longest))
    return np.array(times[:-1])


def levels(grid, duration, draw, shortest, longest, rng) -> np.ndarray:
    """A command held at random levels, one value per grid time."""
    starts = holds(duration, shortest, longest, rng)
    values = np.array([draw() for _ in starts])
    return values[np.searchsorted(starts, grid, "right") - 1]


def waves(grid, middle, swing, slowest, fastest, rng) -> np.ndarray:
    """A command as a sum of three sines, within middle +- swing."""
    total = np.zeros_like(grid)
    for _ in range(3):
        total += np.sin(
            2 * np.pi * rng.uniform(slowest, fastest) * grid + rng.uniform(0, 2 * np.pi)
        )
    return middle + swing * total / 3.0


def exciting(
    rate: float, duration: float, style: str, rng: np.random.Generator, still: float | None = None
) -> np.ndarray:
    """A rich run: beats of many amplitudes, frequencies and offsets, block moves, a coast.

    Args:
        rate: samples per second; commands change on samples, at most five times a second.
        duration: s.
        style: "steps" or "waves".
        rng: source of randomness.
        still: time at the start in which nothing moves; drawn if not given.
    """
    grid = grid_of(rate, duration)
    if style == "steps":
        amplitude = levels(grid, duration, lambda: rng.uniform(0.12, 0.6), 1.5, 5.0, rng)
        frequency = levels(grid, duration, lambda: rng.uniform(0.8, 2.6), 1.5, 5.0, rng)
        offset = levels(
            grid, duration, lambda: rng.choice([0.0, rng.uniform(-0.5, 0.5)]), 1.5, 7.0, rng
        )
    else:
        amplitude = waves(grid, rng.uniform(0.25, 0.4), 0.2, 0.05, 0.4, rng)
        frequency = waves(grid, rng.uniform(1.3, 2.0), 0.7, 0.05, 0.3, rng)
        offset = waves(grid, 0.0, 0.45, 0.05, 0.4, rng)
    shift = levels(grid, duration, lambda: rng.uniform(-0.008, 0.008), 2.0, 6.0, rng)
    turn = levels(grid, duration, lambda: rng.choice([0.0, rng.uniform(-0.6, 0.6)]), 2.0, 6.0, rng)
    amplitude = np.minimum(amplitude, FASTEST_STROKE / (2 * np.pi * frequency))
    coast = rng.uniform(0.3, 0.8) * duration
    amplitude[(grid > coast) & (grid < coast + rng.uniform(2.0, 4.0))] = 0.0
    rows = np.column_stack([grid, offset, amplitude, frequency, shift, turn])
    if still is None:
        still = rng.choice([0.0, rng.uniform(0.5, 1.5)])
    quiet = grid < still
    rows[quiet, 1:3] = 0.0
    rows[quiet, 4:] = 0.0
    return np.round(rows, 6)


def merged(rows: np.ndarray) -> np.ndarray:
    """The rows without those that repeat the commands before them."""
    change = np.any(rows[1:, 1:] != rows[:-1, 1:], axis=1)
    return rows[np.concatenate([[True], change])]


def grid_of(rate: float, duration: float) -> np.ndarray:
    """Times of at most five changes a second, on the samples."""
    return np.arange(0.0, duration, round(rate / 5.0) / rate)


def steady_straight(rate: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """One beat, straight ahead, the block at rest: shows next to nothing."""
    return np.array(
        [[0.0, 0.0, round(rng.uniform(0.3, 0.4), 3), round(rng.uniform(1, 2), 2), 0, 0]]
    )


def without_tail(rate: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """The tail never beats; the block moves, the fish hangs and glides."""
    rows = exciting(rate, duration, "steps", rng, still=0.0)
    rows[:, 1:3] = 0.0
    return rows


def without_block(rate: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """The tail beats in every way, the block never moves."""
    rows = exciting(rate, duration, "steps", rng, still=0.0)
    rows[:, 4:] = 0.0
    return rows


def without_offset(rate: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """The tail beats about its middle only."""
    rows = exciting(rate, duration, "steps", rng, still=0.0)
    rows[:, 1] = 0.0
    return rows


def slow_strokes(rate: float, duration: float, rng: np.random.Generator) -> np.ndarray:
    """No stroke is faster than 1.8 rad/s and the offset stays, so no servo limit is met."""
    rows = exciting(rate, duration, "waves", rng, still=0.0)
    rows[:, 1] = 0.0
    rows[:, 2] = np.minimum(rows[0, 2], 1.8 / (2 * np.pi * rows[:, 3].max()))
    return rows


POOR = {
    "steady_straight": steady_straight,
    "without_tail": without_tail,
    "without_block": without_block,
    "without_offset": without_offset,
    "slow_strokes": slow_strokes,
}
