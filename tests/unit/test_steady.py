"""Steady motion: means over whole beats, and what recorders make of them."""

import numpy as np
import pytest

from fish_env.effects.extended import build_model
from fish_env.errors import ScheduleError
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from fish_env.steady import steady_motion

FISH = load_fish("zheng-2021-a")
TURN = [0.5, 0.35, 1.7, 0.004, 0.1]


@pytest.fixture(scope="module")
def turn() -> dict[str, np.ndarray]:
    return steady_motion(FISH, [TURN], tolerance=1e-7)


def test_means_equal_those_of_a_long_simulation(turn: dict[str, np.ndarray]) -> None:
    beat = 1.0 / TURN[2]
    names = ("tail_offset", "tail_amplitude", "tail_frequency", "block_displacement", "block_angle")
    row = {"t": 0.0, **dict(zip(names, TURN, strict=True))}
    times = np.r_[0.0, 120.0 + beat * np.arange(1001) / 100]
    run = Simulator(FISH).run([row], sample_times_s=times)
    late = slice(1, None)
    span = times[-1] - times[1]
    yaw_rate = (run["yaw"][-1] - run["yaw"][1]) / span
    assert turn["yaw_rate"][0] == pytest.approx(yaw_rate, rel=1e-4)
    for name, column in (("surge_speed", "u"), ("sway_speed", "v"), ("heave_speed", "w")):
        mean = np.trapezoid(run[column][late], times[late]) / span
        assert turn[name][0] == pytest.approx(mean, rel=1e-3)
    assert turn["pitch"][0] == pytest.approx(np.trapezoid(run["pitch"][late], times[late]) / span)
    assert turn["vertical_speed"][0] == pytest.approx((run["z"][-1] - run["z"][1]) / span, rel=1e-4)
    assert turn["yaw_rate_amplitude"][0] == pytest.approx(np.ptp(run["r"][late]) / 2, rel=5e-3)


def test_radius_is_that_of_the_circle_through_points_one_beat_apart(
    turn: dict[str, np.ndarray],
) -> None:
    beat = 1.0 / TURN[2]
    names = ("tail_offset", "tail_amplitude", "tail_frequency", "block_displacement", "block_angle")
    row = {"t": 0.0, **dict(zip(names, TURN, strict=True))}
    run = Simulator(FISH).run([row], sample_times_s=np.r_[0.0, 120.0 + beat * np.arange(60)])
    x, y = run["x"][1:], run["y"][1:]
    basis = np.column_stack([2 * x, 2 * y, np.ones_like(x)])
    a, b, c = np.linalg.lstsq(basis, x**2 + y**2, rcond=None)[0]
    circle = np.sqrt(c + a**2 + b**2)
    # Points at one phase of the beat lie a little off the middle of the swaying.
    assert turn["turn_radius"][0] == pytest.approx(circle, rel=0.02)


def test_mirrored_commands_give_mirrored_motion() -> None:
    motion = steady_motion(FISH, [[0.4, 0.3, 2.0, 0.0, 0.0], [-0.4, 0.3, 2.0, 0.0, 0.0]])
    for name, sign in (("speed", 1), ("turn_radius", 1), ("yaw_rate", -1), ("sway_speed", -1)):
        assert motion[name][1] == pytest.approx(sign * motion[name][0], rel=1e-4)


def test_order_and_company_do_not_matter() -> None:
    commands = np.array([[0.0, 0.3, 2.0, 0, 0], TURN, [0.2, 0.4, 2.0, 0, 0], [0, 0.3, 1.7, 0, 0]])
    together = steady_motion(FISH, commands, tolerance=1e-6)
    alone = [steady_motion(FISH, [row], tolerance=1e-6) for row in commands]
    for name in ("speed", "yaw_rate", "pitch"):
        np.testing.assert_allclose(
            together[name], [m[name][0] for m in alone], rtol=1e-4, atol=1e-6
        )


def test_a_still_tail_leaves_a_trimmed_fish_at_rest() -> None:
    motion = steady_motion(FISH, [[0.3, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0, 0.0]])
    np.testing.assert_allclose(motion["speed"], 0.0, atol=1e-9)
    assert (motion["turn_radius"] > 1e3).all()


def test_a_fast_clock_shows_slow_fish() -> None:
    slow = build_model(FISH, {"clock_scale": {"scale": 0.98}})
    true, seen = steady_motion(FISH, [TURN]), steady_motion(slow, [TURN])
    for name in ("speed", "yaw_rate", "surge_speed"):
        assert seen[name][0] == pytest.approx(0.98 * true[name][0], rel=1e-5)
    assert seen["turn_radius"][0] == pytest.approx(true["turn_radius"][0], rel=1e-5)


def test_records_say_which_fish_differ() -> None:
    model = build_model(FISH)
    drag = "body.plane_xz.drag.c0"
    records = model.records({drag: [FISH.get(drag), 3 * FISH.get(drag)]})
    speed = steady_motion(model, [[0, 0.35, 2.0, 0, 0]] * 2, records=records)["speed"]
    assert speed[1] < 0.9 * speed[0]


def test_a_motion_that_never_settles_says_so() -> None:
    motion = steady_motion(FISH, [[0.0, 0.1, 0.5, 0.0, 0.0]], longest_s=20.0)
    assert motion["change"][0] > 1e-4
    assert motion["swum_s"][0] == pytest.approx(20.0, abs=10.0)


@pytest.mark.parametrize(
    "commands",
    [[[0.0, 0.3, 2.0]], [[0.0, 0.3, -1.0, 0.0, 0.0]], [[0.0, np.nan, 1.0, 0.0, 0.0]], []],
)
def test_impossible_commands_are_refused(commands: list[list[float]]) -> None:
    with pytest.raises(ScheduleError, match="steady commands"):
        steady_motion(FISH, commands)
