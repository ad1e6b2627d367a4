"""Effects that no catalogue entry describes, for cases whose right answer is "none of these"."""

from __future__ import annotations

import math

from tests.hidden.jit import helper
from tests.hidden.servo import FIN, TWO_PI
from tests.hidden.vectors import cross


@helper
def foreign_wrench(t, y, velocity, spin, beat, e, drive, wrench):
    """Adds the foreign forces; `beat` is amplitude times frequency as commanded."""
    u, v, w = velocity
    stroke = (TWO_PI * beat) ** 2
    # Suction towards a floor, felt by fast fish near it.
    if e.floor_suction_gain != 0.0:
        near = math.exp(min((y[2] - e.floor_suction_depth) / e.floor_suction_range, 1.0))
        pull = e.floor_suction_gain * u * u * near
        for i in range(3):
            wrench[i] += pull * y[9 + i]
    # A pump that blows in half of its period.
    if e.pump_force != 0.0 and math.sin(TWO_PI * t / e.pump_period) > 0.0:
        wrench[0] += 0.6 * e.pump_force
        wrench[2] += 0.8 * e.pump_force
        wrench[4] += e.pump_moment
    wrench[3] -= e.roll_yaw_damping_coefficient * spin[2]
    wrench[5] -= e.roll_yaw_damping_coefficient * spin[0]
    # A fin that flips over in the fastest strokes and stays there.
    wrench[5] += drive[FIN] * e.sticking_fin_moment * u * abs(u)
    # Lift of one flank only.
    wrench[1] -= e.one_sided_lift_coefficient * max(v, 0.0) * abs(u)
    # The tail's swirl rolls the fish, its downwash lifts the stern.
    wrench[3] += e.swirl_coefficient * stroke
    wrench[2] += e.downwash_coefficient * stroke
    wrench[4] += 0.15 * e.downwash_coefficient * stroke
    # Heave pitches the fish and pitching lifts it; the two exchange energy and lose none.
    wrench[4] -= e.pitch_heave_coefficient * w * abs(w)
    wrench[2] += e.pitch_heave_coefficient * spin[1] * abs(w)
    if e.compass_torque_moment != 0.0:
        yaw = math.atan2(y[6], y[3])
        wrench[5] -= e.compass_torque_moment * math.sin(yaw - e.compass_torque_heading)


@helper
def flip_fin(spin, e, drive):
    """The sticking fin changes side when the yaw rate passes its threshold."""
    if spin > e.sticking_fin_threshold:
        drive[FIN] = 1.0
    if spin < -e.sticking_fin_threshold:
        drive[FIN] = -1.0


@helper
def slosh(y, dy, ground, spin, down, e, matrix, wrench):
    """Water in the hull, part of its mass, that moves on a spring along x.

    Its displacement s obeys s'' = -k s - c s' - (du/dt + (w x V)_x - g_x); the part with du/dt
    goes into the matrix here and into s'' after the solution.
    """
    m = e.sloshing_mass
    if m == 0.0:
        return
    own = TWO_PI * e.sloshing_frequency
    spring = own * own * y[25] + 2.0 * e.sloshing_damping * own * y[26]
    rest = cross(spin, ground)[0] - down[0]
    matrix[0, 0] -= m
    wrench[0] += m * (spring + rest)
    wrench[4] -= m * y[25] * down[2]
    wrench[5] += m * y[25] * down[1]
    dy[25] = y[26]
    dy[26] = -spring - rest
