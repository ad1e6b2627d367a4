"""Random pushes that no effect describes: coloured forces and moments."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from tests.hidden.simulate import Push

STEP = 0.02
MOMENT_PER_FORCE = 0.025
"""m. A push of 4 mN comes with a moment of 0.1 mN m."""


def ornstein_uhlenbeck(n: int, time_constant: float, rng: np.random.Generator) -> np.ndarray:
    """Unit variance from the first sample on, (n, 6)."""
    keep = np.exp(-STEP / time_constant)
    noise = rng.standard_normal((n, 6))
    noise[1:] *= np.sqrt(1.0 - keep**2)
    return lfilter([1.0], [1.0, -keep], noise, axis=0)


def band(n: int, time_constant: float, rng: np.random.Generator) -> np.ndarray:
    """A resonance: swell-like, around one frequency."""
    turn = 2.0 * np.pi * rng.uniform(0.5, 1.5) / (4.0 * time_constant) * STEP
    keep = np.exp(-STEP / time_constant)
    noise = lfilter(
        [1.0], [1.0, -2 * keep * np.cos(turn), keep**2], rng.standard_normal((n + 3000, 6)), axis=0
    )[3000:]
    return noise / noise.std(axis=0)


def pink(n: int, time_constant: float, rng: np.random.Generator) -> np.ndarray:
    """1/f noise, flat below one over ten time constants."""
    frequency = np.fft.rfftfreq(2 * n, STEP)
    gain = 1.0 / np.sqrt(np.maximum(frequency, 0.1 / time_constant))
    spectrum = gain[:, None] * (
        rng.standard_normal((len(gain), 6)) + 1j * rng.standard_normal((len(gain), 6))
    )
    noise = np.fft.irfft(spectrum, axis=0)[:n]
    return noise / np.fft.irfft(spectrum, axis=0).std(axis=0)


def steps(n: int, time_constant: float, rng: np.random.Generator) -> np.ndarray:
    """Gusts: a level held for a random time, then another."""
    change = rng.random((n, 6)) < STEP / time_constant
    change[0] = True
    level = np.where(change, rng.standard_normal((n, 6)), 0.0)
    last = np.maximum.accumulate(np.where(change, np.arange(n)[:, None], 0), axis=0)
    return np.take_along_axis(level, last, axis=0)


COLOURS = {"ou": ornstein_uhlenbeck, "band": band, "pink": pink, "steps": steps}


def draw_push(
    colour: str,
    force: float,
    time_constant: float,
    inertial: bool,
    span: tuple[float, float],
    rng: np.random.Generator,
) -> Push:
    """A push over a time span, `force` N rms per axis and the moment that goes with it."""
    n = int(np.ceil((span[1] - span[0]) / STEP)) + 2
    unit = COLOURS[colour](n, time_constant, rng)
    scale = np.array([force] * 3 + [force * MOMENT_PER_FORCE] * 3)
    return Push(span[0], STEP, unit * scale, inertial)
