"""From the commands to the tail's angle and the block's place.

The order is that of a real drive: what the controller sends (amplitude, asymmetry, bias), the
transmission delay, the servo's rate limit, the play of its gear, its lag, the tail's flexibility.
The phase is an integral of the frequency that is known in closed form between commands, so the
delayed command is exact. Rate limit and plays have memory and are decided once a step: within a
step each either follows its input exactly or moves evenly. `drive` holds that memory:

0-3 rate limit, 4-7 play of the tail, each: angle at the step's start, 1 when it moves evenly,
its rate then, the step's start time; 8 place of the block behind its play; 9 side of the
sticking fin; 10 row of the commands in force; 11 half stroke (+1 or -1) of the step; 12 moment of
the water about the tail's hinge; 13 fastest that the servo turns during the step; 14 rate of the
tail at the end of the last step; 15 what is added to its acceleration.

A servo under load slows down within `ROTOR` of its load, as its rotor has inertia. Without it the
speed would follow the load of the step before, and the two would jump forth and back.
"""

from __future__ import annotations

import math

from tests.hidden.jit import helper

TWO_PI = 2.0 * math.pi
TIME, OFFSET, AMPLITUDE, FREQUENCY, SHIFT, TURN, PHASE = range(7)
LIMIT, PLAY, BLOCK, FIN, ROW, SIDE, HINGE, FASTEST, LAST, KICK = (
    0, 4, 8, 9, 10, 11, 12, 13, 14, 15,
)  # fmt: skip
DRIVE_SIZE = 16
FREE_SPEED, STALLED, ROTOR = 9.0, 0.05, 0.005
"""rad/s without load, the share of it that a stalled servo still creeps at, and s."""


@helper
def slowed(row, e, table):
    """Share of the commanded frequency that is left under offset and stroke speed."""
    stroke = TWO_PI * table[row, AMPLITUDE] * table[row, FREQUENCY]
    by_offset = 1.0 - e.beat_load_offset * abs(table[row, OFFSET])
    aside = 1.0 - e.side_load_beat * math.tanh(10.0 * abs(table[row, OFFSET]))
    return by_offset * aside * (1.0 - e.beat_load_load * stroke)


@helper
def tail_phase(t, row, e, table):
    """Phase and its two rates within a row of the commands."""
    speed = TWO_PI * e.frequency_scale_scale * table[row, FREQUENCY] * slowed(row, e, table)
    sag = e.battery_sag_rate
    since = table[row, TIME]
    run = (t - since) - 0.5 * sag * (t * t - since * since)
    return table[row, PHASE] + speed * run, speed * (1.0 - sag * t), -speed * sag


@helper
def sent(t, late, e, table, drive):
    """Angle, rate and acceleration that reach the servo at time t, after the delay.

    `late` is the row that reaches it now; before the first one (-1) the tail stands where that
    command begins.
    """
    row = max(late, 0)
    then = t - e.servo_delay_delay if late >= 0 else table[0, TIME]
    phase, rate, bend = tail_phase(then, row, e, table)
    swing, slope = math.sin(phase), math.cos(phase)
    reach = table[row, AMPLITUDE] * e.tail_gain_gain * (1.0 + drive[SIDE] * e.tail_asymmetry_ratio)
    offset = table[row, OFFSET] * e.offset_gain_gain
    reach *= 1.0 - e.swing_loss_per_radian * abs(offset)
    reach *= 1.0 - e.side_load_swing * math.tanh(10.0 * abs(table[row, OFFSET]))
    angle = offset + e.tail_bias_offset + reach * swing
    stopped = min(max(angle, e.angle_limit_lower), e.angle_limit_upper)
    if late < 0 or stopped != angle:
        return stopped, 0.0, 0.0
    return angle, reach * rate * slope, reach * (bend * slope - rate * rate * swing)


@helper
def limited(t, late, e, table, drive):
    """The angle behind the rate limit."""
    if drive[LIMIT + 1] == 1.0:
        return drive[LIMIT] + drive[LIMIT + 2] * (t - drive[LIMIT + 3]), drive[LIMIT + 2], 0.0
    return sent(t, late, e, table, drive)


@helper
def driven(t, late, e, table, drive):
    """The angle behind rate limit and play."""
    if drive[PLAY + 1] == 1.0:
        return drive[PLAY] + drive[PLAY + 2] * (t - drive[PLAY + 3]), drive[PLAY + 2], 0.0
    angle, rate, bend = limited(t, late, e, table, drive)
    return angle + drive[PLAY + 2], rate, bend


@helper
def plan_side(middle, late, e, table, drive):
    """Which half stroke the step with this middle lies in."""
    phase = tail_phase(middle - e.servo_delay_delay, max(late, 0), e, table)[0]
    drive[SIDE] = 1.0 if late >= 0 and math.sin(phase) > 0.0 else -1.0


@helper
def is_limited(e):
    """Whether the servo's speed has a limit."""
    return not (math.isinf(e.servo_rate_limit_rate) and math.isinf(e.servo_torque_limit_torque))


@helper
def plan_limit(t, h, late, e, table, drive):
    """Whether the servo keeps up during the step from t to t + h.

    Under load it slows down along a straight line from its free speed to its stall torque.
    """
    if not is_limited(e):
        return
    most = e.servo_rate_limit_rate
    if not math.isinf(e.servo_torque_limit_torque):
        left = max(1.0 - abs(drive[HINGE]) / e.servo_torque_limit_torque, STALLED)
        drive[FASTEST] += (FREE_SPEED * left - drive[FASTEST]) * (1.0 - math.exp(-h / ROTOR))
        most = min(most, drive[FASTEST])
    here, goal = sent(t, late, e, table, drive)[0], sent(t + h, late, e, table, drive)[0]
    now = drive[LIMIT]
    needed = (goal - now) / h
    keeps_up = abs(needed) <= most
    drive[LIMIT + 1] = 0.0 if keeps_up and abs(here - now) < 1e-9 else 1.0
    drive[LIMIT + 2] = min(max(needed, -most), most)
    drive[LIMIT + 3] = t


@helper
def plan_play(t, h, late, e, table, drive):
    """Whether the gear's flanks touch during the step; half the gap lies on either side."""
    half = 0.5 * e.servo_backlash_gap
    if half == 0.0:
        return
    here = limited(t, late, e, table, drive)[0]
    goal = limited(t + h, late, e, table, drive)[0]
    # A command that jumps takes the tail along at once, as it does without play.
    now = min(max(drive[PLAY], here - half), here + half)
    after = min(max(now, goal - half), goal + half)
    side = 0.0 if after == now else math.copysign(1.0, after - now)
    touching = side != 0.0 and abs(here - side * half - now) < 1e-9
    drive[PLAY] = now
    drive[PLAY + 1] = 0.0 if touching else 1.0
    drive[PLAY + 2] = -side * half if touching else (after - now) / h
    drive[PLAY + 3] = t


@helper
def close_step(t, late, e, table, drive):
    """Remembers where the angles are at the end of a step.

    The play follows the limit, so its angle is read before the limit's own is moved on.
    """
    angle, rate, _ = driven(t, late, e, table, drive)
    if is_limited(e):
        drive[LIMIT] = limited(t, late, e, table, drive)[0]
    if e.servo_backlash_gap != 0.0:
        drive[PLAY] = angle
    drive[LAST] = rate


@helper
def jump_of_rate(t, late, e, table, drive):
    """By how much the tail's rate jumps as a step begins, where a servo that holds it lets it jump.

    A command that jumps moves an ideal servo at no time at all; what the water then gets is left
    out, as in the equations of the paper. Behind a lag or a spring the tail's rate is smooth.
    """
    smooth = e.servo_lag_time_constant > 0.0 or not math.isinf(e.tail_flexibility_natural_frequency)
    bends = e.servo_backlash_gap != 0.0 or is_limited(e) or e.tail_asymmetry_ratio != 0.0
    stops = not (math.isinf(e.angle_limit_lower) and math.isinf(e.angle_limit_upper))
    if smooth or not (bends or stops):
        return 0.0
    return driven(t, late, e, table, drive)[1] - drive[LAST]


@helper
def tail_motion(t, y, dy, late, e, table, drive):
    """Tail angle, rate and acceleration; fills the rates of the servo's own states."""
    angle, rate, bend = driven(t, late, e, table, drive)
    bend += drive[KICK]
    lag = e.servo_lag_time_constant
    dy[18] = 0.0
    if lag > 0.0:
        lagged = (angle - y[18]) / lag
        bend = (rate - lagged) / lag
        angle, rate = y[18], lagged
        dy[18] = lagged
    dy[19] = 0.0
    dy[20] = 0.0
    if not math.isinf(e.tail_flexibility_natural_frequency):
        own = TWO_PI * e.tail_flexibility_natural_frequency
        bend = own * own * (angle - y[19]) - 2.0 * e.tail_flexibility_damping_ratio * own * y[20]
        angle, rate = y[19], y[20]
        dy[19] = rate
        dy[20] = bend
    return angle, rate, bend


@helper
def block_goal(row, e, table, drive):
    """Where the commands put the block: displacement and bracket angle."""
    shift = table[row, SHIFT] * e.block_scale_scale
    if e.block_hysteresis_play > 0.0:
        shift = drive[BLOCK]
    return shift, table[row, TURN]


@helper
def block_motion(y, dy, row, e, table, drive):
    """Displacement of the block, its rate, and the bracket's angle."""
    shift, turn = block_goal(row, e, table, drive)
    dy[21] = 0.0
    lag = e.block_lag_time_constant
    if lag == 0.0:
        return shift, 0.0, turn
    rate = (shift - y[21]) / lag
    dy[21] = rate
    return y[21], rate, turn
