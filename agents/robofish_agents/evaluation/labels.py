"""Labels of metrics, and factors from their SI units to the units that are shown."""

from __future__ import annotations

import numpy as np

from robofish_agents.evaluation.intervals import Interval

DEGREES = 180.0 / np.pi
LABELS: dict[str, tuple[str, float]] = {
    "success_rate": ("success (%)", 100.0),
    "failure_rate": ("failures (%)", 100.0),
    "depth_rmse_m": ("depth RMSE (cm)", 100.0),
    "heading_rmse_rad": ("heading RMSE (deg)", DEGREES),
    "speed_rmse_m_per_s": ("speed RMSE (cm/s)", 100.0),
    "depth_late_rmse_m": ("depth, last 10 s (cm)", 100.0),
    "heading_late_rmse_rad": ("heading, last 10 s (deg)", DEGREES),
    "mean_power_w": ("power (mW)", 1000.0),
    "cost_of_transport": ("cost of transport (1/1000)", 1000.0),
    "action_change": ("action change (%)", 50.0),
    "episode_return": ("return", 1.0),
    "depth_rise_s": ("depth rise (s)", 1.0),
    "depth_settling_s": ("depth settling (s)", 1.0),
    "depth_overshoot": ("depth overshoot (%)", 100.0),
    "heading_rise_s": ("heading rise (s)", 1.0),
    "heading_settling_s": ("heading settling (s)", 1.0),
    "heading_overshoot": ("heading overshoot (%)", 100.0),
    "cross_track_rmse_m": ("cross-track RMSE (cm)", 100.0),
    "cross_track_late_rmse_m": ("cross-track, last 10 s (cm)", 100.0),
    "path_progress": ("completed share of the path (%)", 100.0),
    "place_rmse_m": ("place RMSE (cm)", 100.0),
    "place_late_rmse_m": ("place, last 10 s (cm)", 100.0),
}
"""Of every metric. An action change of 100 % is from one end of the range to the other."""


def mean_and_range(metric: str, interval: Interval | None) -> tuple[str, str]:
    """A metric in the unit of its label: its mean, and its interval; "-" if it does not apply."""
    if interval is None:
        return "-", ""
    factor = LABELS[metric][1]
    mean, low, high = (_short(factor * value) for value in interval)
    return mean, f"{low} to {high}"


def _short(value: float) -> str:
    """Three digits, without exponents."""
    if abs(value) >= 100:
        return f"{value:.0f}"
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"
