"""The paper's statements, each with a criterion that can fail and the numbers that decide it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.studies.paper import ranges
from fish_env.studies.paper.motions import Map, Study
from fish_env.studies.paper.series import (
    beat_means,
    dominant_frequency,
    sine_share,
    steady_part,
    velocity_inertial,
)

DEG = 180.0 / np.pi
HELD, NOT_HELD = "held", "not held by this model"


@dataclass(frozen=True)
class Statement:
    """One statement of the paper, checked.

    Attributes:
        motion: Which of the four motions, or the variant of one.
        statement: What the paper reports, in our words.
        criterion: What has to be true here for it to count as held.
        measured: The numbers that decide.
        held: Whether they do.
        remark: What to make of it, if there is more to say.
    """

    motion: str
    statement: str
    criterion: str
    measured: str
    held: bool
    remark: str = ""

    @property
    def verdict(self) -> str:
        """In words."""
        return HELD if self.held else NOT_HELD


def all_statements(study: Study) -> list[Statement]:
    """Every statement about a trend, in the paper's order, then those with servo lag."""
    return [
        *rectilinear(study),
        *turning(study),
        *turning_rates(study.turning, "turning"),
        *gliding(study),
        *spiral(study),
        *magnitudes(study),
    ]


def trend(
    motion: str, name: str, values: FloatArray, axis: int, rising: bool, unit: str, remark: str = ""
) -> Statement:
    """Checks that values rise (or fall) strictly along an axis of a map, in every row of it.

    Args:
        motion: Which motion.
        name: Such as "U_r grows with f1".
        values: Shape (m, n), rows by the first command, columns by frequency.
        axis: 1 along frequency, 0 along the first command.
        rising: True for growing.
        unit: Unit of the values.
        remark: More to say.
    """
    signed = values if rising else -values
    steps = np.diff(signed, axis=axis)
    good, series = int(np.sum(np.all(steps > 0, axis=axis))), steps.shape[1 - axis]
    ends = np.take(values, [0, -1], axis=axis)
    first, last = (float(np.mean(np.take(ends, i, axis=axis))) for i in (0, 1))
    return Statement(
        motion,
        name,
        f"strictly {'rising' if rising else 'falling'} in all {series} series",
        f"in {good} of {series}; on average from {first:.3g} to {last:.3g} {unit}",
        good == series,
        remark,
    )


def rectilinear(study: Study) -> list[Statement]:
    """Statements about swimming straight (the paper's section IV.A)."""
    name, m = "rectilinear", study.straight.motion
    roll, pitch = DEG * m["roll_extreme"].max(), DEG * m["pitch_extreme"].max()
    yaw_rate = DEG * np.abs(m["yaw_rate"]).max()
    return [
        trend(name, "U_r grows with f1", m["horizontal_speed"], 1, True, "m/s"),
        trend(name, "U_r grows with A1", m["horizontal_speed"], 0, True, "m/s"),
        _limit(name, "roll stays within 3 deg", "largest |roll|", roll, 3.0, "deg"),
        _limit(name, "pitch stays within 3 deg", "largest |pitch|", pitch, 3.0, "deg"),
        _about_zero(study, "roll"),
        _about_zero(study, "pitch"),
        _limit(name, "yaw oscillates about a constant", "|mean yaw rate|", yaw_rate, 0.1, "deg/s"),
        trend(name, "the yaw amplitude grows with A1", DEG * m["yaw_amplitude"], 0, True, "deg"),
        trend(name, "the yaw rate grows with f1", DEG * m["yaw_rate_amplitude"], 1, True, "deg/s"),
    ]


def _limit(
    motion: str, statement: str, quantity: str, value: float, limit: float, unit: str
) -> Statement:
    criterion = f"{quantity} below {limit:g} {unit} for every combination"
    return Statement(motion, statement, criterion, f"{value:.3g} {unit}", bool(value < limit))


def _about_zero(study: Study, angle: str) -> Statement:
    mean = DEG * study.straight.motion[angle]
    worst = float(mean.flat[np.argmax(np.abs(mean))])
    remark = "" if abs(worst) < 1.0 else "the faster fish swims with its nose a little down"
    return Statement(
        "rectilinear",
        f"{angle} oscillates about zero",
        f"|mean {angle}| below 1 deg for every combination",
        f"mean furthest from zero {worst:.2f} deg",
        abs(worst) < 1.0,
        remark,
    )


def turning(study: Study) -> list[Statement]:
    """Statements about turning rate and radius (section IV.B)."""
    name, m = "turning", study.turning.motion
    rate, radius = np.abs(m["yaw_rate"]), m["turn_radius"]
    return [
        trend(name, "w_t grows with the offset", rate, 0, True, "rad/s"),
        trend(name, "w_t grows with f1", rate, 1, True, "rad/s"),
        trend(name, "R_t falls with the offset", radius, 0, False, "m"),
        constant_radius(study.turning, name),
        _signs(study),
        _rates_about_zero(study, "p", "roll"),
        _rates_about_zero(study, "q", "pitch"),
        _beat_of_yaw_rate(study),
    ]


def constant_radius(turning_map: Map, name: str) -> Statement:
    """R_t nearly constant in frequency."""
    radius = turning_map.motion["turn_radius"]
    spread = 100.0 * float(np.max(np.ptp(radius, axis=1) / radius.mean(axis=1)))
    return Statement(
        name,
        "R_t is nearly constant in f1",
        "range over f1 below 10 % of the mean, for every offset",
        f"largest range {spread:.1f} % of the mean",
        spread < 10.0,
    )


def _signs(study: Study) -> Statement:
    left, right = study.turning_left.motion["yaw_rate"], study.turning.motion["yaw_rate"]
    return Statement(
        "turning",
        "a negative offset gives a positive yaw rate, a positive one a negative",
        "for every offset and frequency",
        f"yaw rate {left.min():+.3f} to {left.max():+.3f} rad/s for negative offsets, "
        f"{right.min():+.3f} to {right.max():+.3f} rad/s for positive",
        bool((left > 0).all() and (right < 0).all()),
    )


def _rates_about_zero(study: Study, channel: str, name: str) -> Statement:
    rates = [DEG * steady_part(run, channel) for run in study.turning_series.values()]
    worst = max(abs(float(rate.mean())) for rate in rates)
    crossing = all(rate.min() < 0.0 < rate.max() for rate in rates)
    return Statement(
        "turning",
        f"the {name} rate oscillates about zero",
        "of both signs, |mean| below 1 deg/s, six combinations",
        f"largest |mean| {worst:.3f} deg/s, amplitudes {min(np.ptp(r) / 2 for r in rates):.2f} to "
        f"{max(np.ptp(r) / 2 for r in rates):.2f} deg/s",
        crossing and worst < 1.0,
    )


def _beat_of_yaw_rate(study: Study) -> Statement:
    found = {
        pair: dominant_frequency(steady_part(trajectory, "r"))
        for pair, trajectory in study.turning_series.items()
    }
    worst = max(abs(frequency - pair[1]) for pair, frequency in found.items())
    return Statement(
        "turning",
        "the yaw rate alternates faster with f1",
        "its main frequency is f1 within 0.1 Hz, six combinations",
        f"largest difference {worst:.3f} Hz",
        worst < 0.1,
    )


def turning_rates(turning_map: Map, name: str) -> list[Statement]:
    """Statements about the amplitudes of the angular rates when turning (section IV.B)."""
    yaw, roll, pitch = (
        DEG * turning_map.motion[f"{angle}_rate_amplitude"] for angle in ("yaw", "roll", "pitch")
    )
    lagging = name != "turning"
    why = (
        ""
        if lagging
        else "a servo that loses amplitude with frequency would explain the paper; see below"
    )
    grows = (
        ""
        if lagging
        else "an offset tail pushes more along the fish, which shortens its lever about O_b"
    )
    texts = "the amplitude of the {} rate falls with f1"
    return [
        trend(
            name,
            "the amplitude of the yaw rate grows with the offset",
            yaw,
            0,
            True,
            "deg/s",
            grows,
        ),
        trend(name, texts.format("yaw"), yaw, 1, False, "deg/s", why),
        trend(name, texts.format("roll"), roll, 1, False, "deg/s", why),
        trend(name, texts.format("pitch"), pitch, 1, False, "deg/s", why),
    ]


def with_servo_lag(study: Study) -> list[Statement]:
    """The turning statements again with the longest servo lag that was tried."""
    lag = max(study.lagged)
    lagged, name = study.lagged[lag], f"turning, servo_lag {lag:g} s"
    rate, radius = np.abs(lagged.motion["yaw_rate"]), lagged.motion["turn_radius"]
    return [
        *turning_rates(lagged, name),
        trend(name, "w_t grows with the offset", rate, 0, True, "rad/s"),
        trend(name, "w_t grows with f1", rate, 1, True, "rad/s"),
        trend(name, "R_t falls with the offset", radius, 0, False, "m"),
        constant_radius(lagged, name),
    ]


def gliding(study: Study) -> list[Statement]:
    """Statements about gliding (section IV.C)."""
    speed, fast = study.gliding.motion["speed"], study.accelerating
    share = 100.0 * fast.last_speed / fast.uniform_speed
    return [
        Statement(
            "gliding",
            "U_g falls as |dd| grows from 0 to 1.4 cm",
            f"strictly falling over {len(speed)} displacements",
            f"from {speed[0]:.4f} to {speed[-1]:.4f} m/s",
            bool(np.all(np.diff(speed) < 0)),
        ),
        Statement(
            "gliding",
            "at dd -1.7 to -2.0 cm the depth is used up before the motion is uniform",
            f"speed below 98 % of the uniform one once the depth has changed by "
            f"{ranges.TANK_DEPTH_M - ranges.HULL_HEIGHT_M:.3f} m (tank less hull)",
            f"{share.min():.1f} to {share.max():.1f} % after {fast.time_s.min():.1f} to "
            f"{fast.time_s.max():.1f} s; means on the way {fast.mean_speed.min():.3f} to "
            f"{fast.mean_speed.max():.3f} m/s",
            bool(np.all(share < 98.0)),
            "the steepness of the paper's fish and the depth it had left are not printed",
        ),
    ]


def spiral(study: Study) -> list[Statement]:
    """Statements about the spiral (section IV.D)."""
    trajectory, rate = study.spiral_series, study.spiral.motion["yaw_rate"]
    frequency = ranges.SPIRAL_HZ
    yaw = beat_means(trajectory["yaw"], frequency)
    turns = abs(yaw[-1] - yaw[0]) / (2 * np.pi)
    vertical = beat_means(velocity_inertial(trajectory)[2], frequency)
    late = vertical[len(vertical) // 2 :]
    shares = [sine_share(trajectory, axis, frequency) for axis in (0, 1)]
    return [
        Statement(
            "spiral",
            "yaw grows steadily",
            "mean yaw per beat is monotone after the first 10 s",
            f"{turns:.2f} turns in {trajectory.time_s[-1]:.0f} s",
            bool(np.all(np.diff(yaw[int(10 * frequency) :]) * np.sign(rate[0]) > 0)),
        ),
        _constant_angle(study, "pitch"),
        _constant_angle(study, "roll"),
        Statement(
            "spiral",
            "V_Ix and V_Iy are sine-like",
            "a sine at the mean yaw rate explains 95 % of both, second half of the run",
            f"{100 * shares[0]:.2f} and {100 * shares[1]:.2f} %",
            min(shares) > 0.95,
        ),
        Statement(
            "spiral",
            "V_Iz settles at a negative value: the fish spirals up",
            "second half negative with a range below 5 % of its mean",
            f"mean {late.mean():.4f} m/s, range {np.ptp(late):.5f} m/s",
            bool((late < 0).all() and np.ptp(late) < 0.05 * abs(late.mean())),
            f"at dd {ranges.SPIRAL_SERIES_CM:+g} cm: in our frame a positive dd climbs",
        ),
        _barely(study, "w_s", "yaw_rate", "rad/s"),
        _barely(study, "U_s", "speed", "m/s"),
    ]


def _constant_angle(study: Study, angle: str) -> Statement:
    means = DEG * beat_means(study.spiral_series[angle], ranges.SPIRAL_HZ)
    late = means[len(means) // 2 :]
    return Statement(
        "spiral",
        f"{angle} oscillates about a constant",
        "mean per beat within 0.5 deg over the second half of the run",
        f"mean {late.mean():.2f} deg, range {np.ptp(late):.3f} deg",
        bool(np.ptp(late) < 0.5),
    )


def _barely(study: Study, symbol: str, name: str, unit: str) -> Statement:
    values = np.abs(study.spiral.motion[name])
    spread = 100.0 * float(np.ptp(values) / values.mean())
    low, high = study.spiral.displacements_cm[[0, -1]]
    return Statement(
        "spiral",
        f"{symbol} barely changes with dd",
        "range below 10 % of the mean",
        f"{values.min():.4f} to {values.max():.4f} {unit}, range {spread:.1f} % of the mean, "
        f"dd {low:g} to {high:g} cm",
        spread < 10.0,
    )


def magnitudes(study: Study) -> list[Statement]:
    """What the printed errors imply about sizes, compared within a factor of two.

    A mean error of 0.0657 m and of 18.5913 % make a radius of 0.353 m. A coefficient of
    determination R^2 and a mean absolute error e make a standard deviation of the measured values
    of e sqrt(pi/2) / sqrt(1 - R^2), if errors are normal.
    """

    def implied_sd(r_squared: float, mae: float) -> float:
        return mae * float(np.sqrt(np.pi / 2) / np.sqrt(1.0 - r_squared))

    radius = float(study.turning.motion["turn_radius"].mean())
    speed_sd = float(study.straight.motion["horizontal_speed"].std())
    rate_sd = float(study.turning.motion["yaw_rate"].std())
    return [
        _magnitude("turning", "mean R_t", 0.0657 / 0.185913, radius, "m"),
        _magnitude("turning", "spread of w_t", implied_sd(0.7462, 0.0409), rate_sd, "rad/s"),
        _magnitude("rectilinear", "spread of U_r", implied_sd(0.8898, 0.0137), speed_sd, "m/s"),
    ]


def _magnitude(motion: str, name: str, printed: float, here: float, unit: str) -> Statement:
    ratio = here / printed
    return Statement(
        motion,
        f"{name} is about {printed:.2g} {unit} (implied by the printed errors)",
        "within a factor of 2",
        f"{here:.3g} {unit}, {ratio:.2f} times that",
        0.5 < ratio < 2.0,
        "depends on the chosen ranges",
    )


NOT_CHECKABLE = (
    "R^2 0.8898 and MAE 0.0137 m/s of U_r, trajectory error of at most 0.2407 m",
    "R^2 0.7462 and MAE 0.0409 rad/s of w_t, MAE 0.0657 m and 18.5913 % of R_t",
    "error of U_g of at most 14.0507 %, 3.5340 % on average",
    "errors of w_s (at most 3.6004 %, mean 1.9323 %) and U_s (11.4808 %, 5.8953 %), trajectory "
    "error of at most 0.3974 m",
    "61.45 % fit of the damping estimation over 28 s",
)
"""Numbers about measurements that stand only in figures: they need the measured values."""
