"""The commands of the four studies.

The paper prints tail amplitude and frequency of gliding and spiralling and the displacements of
gliding. Its other ranges stand on figure axes and in a supplement that are not available, so they
are chosen here; `CHOSEN` says so in the report.
"""

from __future__ import annotations

import numpy as np

FISH_A, FISH_B = "zheng-2021-a", "zheng-2021-b"
FREQUENCIES_HZ = (1.0, 1.5, 2.0, 2.5, 3.0)
AMPLITUDES_DEG = (15.0, 20.0, 25.0, 30.0)
RECTILINEAR_SERIES = ((20.0, 1.0), (20.0, 2.0), (20.0, 3.0), (15.0, 2.0), (30.0, 2.0))
"""Five combinations of amplitude (deg) and frequency (Hz) shown over time."""
TURNING_AMPLITUDE_DEG = 20.0
OFFSETS_DEG = (15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0)
TURNING_SERIES = ((-30.0, 1.0), (20.0, 1.0), (40.0, 1.0), (-30.0, 2.0), (20.0, 2.0), (40.0, 2.0))
"""Six combinations of offset (deg) and frequency (Hz) shown over time."""
GLIDING_AMPLITUDE_DEG, GLIDING_HZ = 20.0, 2.0
GLIDING_CM = tuple(np.round(np.arange(0.0, -1.5, -0.2), 1))
ACCELERATING_CM = (-1.7, -1.8, -1.9, -2.0)
SPIRAL_AMPLITUDE_DEG, SPIRAL_HZ = 20.0, 3.0
SPIRAL_OFFSET_DEG = 20.0
SPIRAL_CM = tuple(np.round(np.arange(-1.2, 1.3, 0.3), 1))
SPIRAL_SERIES_CM = 0.9
"""Displacement of the spiral that is shown over time; positive climbs in our frame."""
TANK_DEPTH_M, HULL_HEIGHT_M = 0.8, 0.134
SERVO_LAGS_S = (0.03, 0.06, 0.09, 0.12, 0.15)

CHOSEN = (
    "rectilinear: A1 15 to 30 deg, f1 1 to 3 Hz",
    "turning: A1 20 deg, offset 15 to 45 deg, f1 1 to 3 Hz",
    "spiral: offset 20 deg, dd -1.2 to 1.2 cm",
    "the five and six combinations shown over time",
)
"""Ranges that the paper does not print."""
