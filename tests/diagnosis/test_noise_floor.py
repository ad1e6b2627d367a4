"""The noise of a channel, told from its motion by the data alone."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.identification.recorded import recorded
from fish_env.rigidbody.noise_floor import (
    _contrasts,
    _correlation,
    _differences,
    as_dict,
    floor_of,
    noise_floors,
    sentences,
)

STILL = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
BEATING = np.array([0.0, 0.4, 1.0, 0.0, 0.0])


def dataset(seed=0, sd=0.01, beat=2.0, size=0.1, runs=4, seconds=20.0, rate=25.0, **about):
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate)) / rate
    switch = min(10.0, 0.5 * seconds)
    steps = CommandSteps(np.array([0.0, switch]), np.array([BEATING, STILL]))
    fading = 0.5 - 0.5 * np.tanh(6.0 * (time - switch - 0.4))
    made = []
    for number in range(runs):
        motion = size * fading * np.sin(2 * np.pi * beat * time + number) + 0.02 * time
        values = {"yaw": motion + sd * rng.standard_normal(len(time))}
        about_run = {"start": "rest", "tail_phase": 0.0, "condition": about.get("condition")}
        made.append(Run.from_steps(f"r{number}", time, values, steps, **about_run))
    return recorded(Dataset("made", "zheng-2021-a", tuple(made), about.get("noise", {})))


@pytest.mark.parametrize("rate", [15.0, 25.0, 60.0])
@pytest.mark.parametrize("beat", [0.7, 2.0])
def test_the_noise_is_found_under_a_beat(rate, beat):
    floor = floor_of(dataset(rate=rate, beat=beat), "yaw")
    assert floor.white.sd == pytest.approx(0.01, rel=0.06)
    assert not floor.contradicts


def test_a_quicker_beat_needs_a_higher_order():
    slow, quick = (floor_of(dataset(beat=beat), "yaw") for beat in (0.2, 2.5))
    assert quick.order > slow.order
    assert quick.white.freedom < slow.white.freedom


def test_an_order_that_is_too_low_takes_the_motion_for_noise():
    """What the choice of the order protects from."""
    run = dataset(beat=2.5).runs[0]
    too_low = _differences([(run.time_s, run.channels["yaw"])], 2)
    assert too_low.sd > 1.2 * 0.01


def test_intervals_cover_and_freedom_is_right():
    covered, spreads = 0, []
    for seed in range(60):
        white = floor_of(dataset(seed, size=0.0, runs=1, seconds=10.0), "yaw").white
        low, high = white.ci95
        covered += low <= 0.01 <= high
        spreads.append(white.sd)
    assert covered >= 50
    expected = 0.01 / np.sqrt(2.0 * white.freedom)
    assert np.std(spreads) == pytest.approx(expected, rel=0.4)


def test_jerks_now_and_then_do_not_pass_for_noise():
    made = dataset(size=0.0)
    for run in made.runs:
        run.channels["yaw"][::60] += 0.2
    floor = floor_of(made, "yaw")
    assert floor.upper_bound
    assert floor.white.sd == pytest.approx(0.01, rel=0.2)


def test_uneven_samples_leave_polynomials_out():
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.02, 0.06, 400))
    assert np.abs(_contrasts(time, 3.0 + 2.0 * time**2, 4)).max() < 1e-8
    noise = rng.standard_normal(400)
    assert np.mean(_contrasts(time, noise, 4) ** 2) == pytest.approx(1.0, rel=0.3)


def test_correlation_counts_differences_of_white_noise():
    differences = _contrasts(np.arange(20000.0), np.random.default_rng(0).standard_normal(20000), 3)
    power = np.array([d @ d / len(d) for d in differences[:19800].reshape(-1, 99)])
    assert 2.0 / np.var(power) == pytest.approx(99 / _correlation(3), rel=0.3)


def test_missing_samples():
    made = dataset()
    rng = np.random.default_rng(1)
    for run in made.runs:
        run.channels["yaw"][rng.random(len(run.time_s)) < 0.3] = np.nan
    floor = floor_of(made, "yaw")
    assert 0.008 < floor.white.sd < 0.02
    assert floor.white.sd < 0.0125 or floor.upper_bound


def test_still_stretches_show_slow_noise_that_differences_do_not():
    made = dataset(size=0.0)
    for number, run in enumerate(made.runs):
        run.channels["yaw"] += 0.03 * np.sin(2 * np.pi * 0.5 * run.time_s + number)
    floor = floor_of(made, "yaw")
    assert floor.white.sd == pytest.approx(0.01, rel=0.1)
    assert floor.still.sd > 0.02
    assert floor_of(dataset(), "yaw").still.sd == pytest.approx(0.01, rel=0.1)


def test_repeats_of_one_condition_show_what_differs_between_them():
    floor = floor_of(dataset(size=0.0, condition="A"), "yaw")
    assert floor.repeats.sd == pytest.approx(0.01 * np.sqrt(2.0), rel=0.45)
    assert floor_of(dataset(), "yaw").repeats is None


@pytest.mark.parametrize(("declared", "wrong"), [(0.01, False), (0.02, True), (0.005, True)])
def test_a_declared_noise_is_compared(declared, wrong):
    floors = noise_floors(dataset(noise={"yaw": declared}))
    assert floors[0].contradicts is wrong
    assert any("declares a noise" in s for s in sentences(floors)) is wrong


def test_too_few_samples_say_so():
    made = dataset(runs=1, seconds=10.0)
    run = made.runs[0]
    values = np.full(len(run.time_s), np.nan)
    values[:8] = 0.1
    floor = floor_of(replace(made, runs=(replace(run, channels={"yaw": values}),)), "yaw")
    assert floor.white is None
    assert "too few samples" in sentences((floor,))[0]
    assert as_dict(floor)["white"] is None
