"""A body that bends where the tail is fixed."""

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.unit.effects.support import assert_same_motion, held, run

SOFT = {"body_flexibility": {"stiffness": 0.1}}
BEAT = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]


def bend(effects, commands, seconds, fish, dt=0.0025, **start):
    """Time (s) and the tail's angle beyond its command (rad)."""
    way = run(effects, commands, seconds, fish=fish, dt=dt, rate_hz=400.0, **start)
    told = Simulator(fish, dt, effects).outputs(way)
    stiff = Simulator(fish, dt).outputs(run(None, commands, seconds, fish=fish, dt=dt,
                                            rate_hz=400.0, **start))  # fmt: skip
    return way.time_s, told["tail_angle"] - stiff["tail_angle"], told


def test_a_held_fish_bends_by_the_moment_over_the_stiffness():
    """In a cross-flow that does not change: delta = moment / stiffness."""
    fish = held()
    _, delta, _ = bend(SOFT, [{"t": 0.0}], 3.0, fish, velocity_body=(0.0, 0.1, 0.0))
    angle = delta[-1]
    across, along = 0.1 * np.cos(angle), 0.1 * np.sin(angle)
    s = across / 0.1
    width = 0.5 * fish.get("water.density") * fish.get("tail.area")
    drag = fish.get("tail.drag.c0") + fish.get("tail.drag.c2") * s**2
    lift = fish.get("tail.lift.c1") * s * (along / 0.1)
    force = width * 0.1**2 * (drag * s + lift * (along / 0.1))
    assert abs(angle) > 0.01
    np.testing.assert_allclose(angle, fish.get("tail.center_of_pressure") * force / 0.1, rtol=0.02)


def test_in_thin_water_it_swings_at_its_own_frequency():
    """A step of the command leaves the body straight; a load of next to nothing too."""
    fish = held().replace({"water.density": 1e-6})
    _, delta, _ = bend(SOFT, BEAT, 1.0, fish)
    assert np.abs(delta).max() < 1e-6


def test_a_heavier_load_bends_it_more_than_in_proportion_to_the_stroke():
    """The moment grows with the square of the rate."""
    fish = held()
    small, large = (
        np.abs(bend(SOFT, [{**BEAT[0], "tail_amplitude": a}], 3.0, fish)[1][800:]).max()
        for a in (0.1, 0.2)
    )
    assert 3.0 * small < large < 4.2 * small


def test_it_is_late_by_less_power_than_a_stiff_body_takes():
    """The tail follows the water: it pays less power at the same command."""
    fish = held()
    _, _, told = bend(SOFT, BEAT, 3.0, fish)
    _, _, stiff = bend({"body_flexibility": {"stiffness": 1e5}}, BEAT, 3.0, fish)
    assert told["tail_power"][400:].mean() < stiff["tail_power"][400:].mean()


def test_a_stiff_body_is_none():
    assert_same_motion(
        run({"body_flexibility": {"stiffness": 1e5}}, BEAT, 2.0), run(None, BEAT, 2.0), atol=1e-4
    )


@pytest.mark.parametrize("stiffness", [0.02, 0.1])
def test_smaller_steps_tell_the_same(stiffness):
    soft = {"body_flexibility": {"stiffness": stiffness}}
    coarse, fine = (run(soft, BEAT, 2.0, dt=dt) for dt in (0.005, 0.00125))
    plain = run(None, BEAT, 2.0, dt=0.00125)
    effect = np.abs(fine.states[:, :3] - plain.states[:, :3]).max()
    assert effect > 0.005
    assert np.abs(coarse.states[:, :3] - fine.states[:, :3]).max() < 0.01 * effect
