"""Small measures of one motion over time."""

from __future__ import annotations

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.studies.paper.motions import SERIES_HZ
from fish_env.trajectory import Trajectory


def steady_part(trajectory: Trajectory, name: str) -> FloatArray:
    """The second half of a column; it holds whole beats of every frequency that is used."""
    return trajectory[name][(len(trajectory) + 1) // 2 :]


def velocity_inertial(trajectory: Trajectory) -> FloatArray:
    """dx/dt, dy/dt, dz/dt, shape (3, T), m/s."""
    position = np.stack([trajectory[name] for name in "xyz"])
    return np.asarray(np.gradient(position, trajectory.time_s, axis=1))


def beat_means(values: FloatArray, frequency_hz: float) -> FloatArray:
    """Running means over one tail beat, one value a beat, shape (beats,).

    Beats need not be whole numbers of samples: the integral is interpolated.
    """
    time = np.arange(len(values)) / SERIES_HZ
    steps = np.diff(time) * (values[1:] + values[:-1]) / 2
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    edges = np.arange(int(time[-1] * frequency_hz) + 1) / frequency_hz
    return np.asarray(np.diff(np.interp(edges, time, integral)) * frequency_hz)


def dominant_frequency(values: FloatArray) -> float:
    """Frequency of the largest peak of the spectrum, Hz."""
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values))))
    return float(np.fft.rfftfreq(len(values), 1.0 / SERIES_HZ)[int(np.argmax(spectrum))])


def sine_share(trajectory: Trajectory, axis: int, frequency_hz: float) -> float:
    """Share of the variance of V_Ix (axis 0) or V_Iy (1) that one sine explains.

    Means per beat over the second half of the run; the sine has the mean yaw rate.
    """
    means = beat_means(velocity_inertial(trajectory)[axis], frequency_hz)
    half = len(means) // 2
    values, time = means[half:], np.arange(half, len(means)) / frequency_hz
    yaw = beat_means(trajectory["yaw"], frequency_hz)[half:]
    rate = (yaw[-1] - yaw[0]) / (time[-1] - time[0])
    basis = np.column_stack([np.ones_like(time), np.sin(rate * time), np.cos(rate * time)])
    fitted = basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(1.0 - np.sum((values - fitted) ** 2) / np.sum((values - values.mean()) ** 2))
