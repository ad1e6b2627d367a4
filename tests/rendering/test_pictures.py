"""What a picture shows."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fish_env import rendering
from fish_env.rendering import Goal, Setting, Tank, mosaic, view
from fish_env.rendering.mosaics import layout
from fish_env.rendering.views import View
from tests.rendering.scenes import AHEAD, LEVEL, SETTING, changed, line_of, mint, orange, scene

UPPER = slice(30, 340)
"""Rows above the instruments."""


@pytest.fixture(autouse=True)
def strict():
    """Every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def bare(moment, size=(640, 480), setting=SETTING) -> np.ndarray:
    """The picture without instruments."""
    return View(setting, size, instruments=False).frame(moment)


def test_a_picture_is_an_array_of_colours():
    frame = view(SETTING).frame(scene())
    assert frame.shape == (480, 640, 3)
    assert frame.dtype == np.uint8
    assert frame.flags.writeable
    assert frame.flags.c_contiguous


def test_the_same_scene_gives_the_same_picture():
    np.testing.assert_array_equal(view(SETTING).frame(scene()), view(SETTING).frame(scene()))


def test_a_picture_handed_out_is_not_drawn_over():
    one = view(SETTING)
    frame = one.frame(scene())
    kept = frame.copy()
    one.frame(scene(time_s=5.1, tail_angle=-0.3))
    np.testing.assert_array_equal(frame, kept)


def test_the_fish_is_in_the_middle():
    rows, columns = np.nonzero(orange(bare(scene())))
    assert len(rows) > 1500
    assert 150 < rows.mean() < 280
    assert 200 < columns.mean() < 360


def test_the_check_for_the_fish_notices_that_there_is_none():
    one = View(SETTING, instruments=False)
    one.follower.distance = 100.0
    assert orange(one.frame(scene())).sum() < 50


@pytest.mark.parametrize(
    "change",
    [
        {"tail_angle": -0.4},
        {"actuators": np.array([0.0, 0.3, 2.0, 0.012, 0.0])},
        {"actuators": np.array([0.0, 0.3, 2.0, 0.0, 0.7])},
        {"wake": line_of(60)},
        {"goal": Goal(0.62, 0.8, 0.1)},
        {"goal": Goal(0.4, 0.3, 0.1)},
        {"goal": None},
    ],
    ids=["tail", "block aft", "block swung", "wake", "goal heading", "goal depth", "no goal"],
)
def test_what_changes_can_be_seen(change):
    different = changed(bare(scene()), bare(scene(**change)))[UPPER]
    assert different.sum() > 60


def test_without_a_change_nothing_looks_changed():
    assert changed(bare(scene()), bare(scene())).sum() == 0


def test_the_arrow_is_ahead_of_the_fish_and_turns_with_the_goal():
    """The camera is to starboard, so ahead is right; a goal on the other bow points elsewhere."""
    ahead = np.nonzero(mint(bare(scene(goal=replace(AHEAD, depth=0.5)))))
    astern = np.nonzero(mint(bare(scene(goal=Goal(0.5, 0.3 + np.pi, 0.1)))))
    assert ahead[1].mean() > 400
    assert astern[1].mean() < 200


def test_the_goal_covers_the_part_of_the_fish_on_its_other_side():
    """A plane through the middle of the fish tints its lower half, seen from above."""
    with_plane, without = bare(scene(goal=Goal(0.5, 3.0, 0.1))), bare(scene(goal=None))
    rows, columns = np.nonzero(orange(without))
    above, below = rows < rows.mean() - 25, rows > rows.mean() + 25
    different = changed(with_plane, without, by=6)[rows, columns]
    assert different[below].mean() > 0.5
    assert different[above].mean() < 0.1


def test_rolling_turns_the_horizon_of_the_instruments():
    one, other = (view(SETTING).frame(scene((roll, 0.0, 0.3))) for roll in (0.0, 0.5))
    assert changed(one, other)[380:450, 15:90].sum() > 100


@pytest.mark.parametrize("size", [(16, 16), (96, 64), (240, 180), (333, 251), (1280, 800)])
@pytest.mark.parametrize("goal", [AHEAD, None])
def test_any_size_can_be_drawn(size, goal):
    frame = view(SETTING, size).frame(scene(goal=goal, wake=line_of(5)))
    assert frame.shape == (size[1], size[0], 3)
    assert frame.std() > 3.0


@pytest.mark.parametrize("depth", [0.0, 0.03, 0.97, 1.2])
@pytest.mark.parametrize("euler", [LEVEL, (3.0, 1.5, -3.1), (0.0, -1.57, 2.0)])
@pytest.mark.parametrize("elevation", [0.0, 1.3, -1.6])
def test_no_pose_and_no_camera_breaks_it(depth, euler, elevation):
    one = View(SETTING, (160, 120))
    one.follower.orbit(2.0, elevation)
    one.follower.zoom(0.3)
    goal = Goal(depth, 0.0, 0.0)
    frame = one.frame(scene(euler, position=np.array([0.0, 0.0, depth]), goal=goal))
    assert frame.shape == (120, 160, 3)


def test_walls_are_drawn():
    walled = Setting(SETTING.shape, Tank(walls=(-1.0, 1.0, -1.0, 1.0)))
    assert changed(bare(scene()), bare(scene(), setting=walled)).sum() > 300


@pytest.mark.parametrize(
    ("count", "size", "expected"),
    [
        (1, (640, 480), (1, 1)),
        (4, (640, 480), (2, 2)),
        (9, (960, 720), (3, 3)),
        (2, (1280, 480), (2, 1)),
    ],
)
def test_tiles_are_laid_out_to_fill_the_picture(count, size, expected):
    assert layout(count, size) == expected


def test_a_mosaic_shows_each_fish_as_it_would_be_alone():
    whole = mosaic(SETTING, 4, (642, 482))
    moments = [scene(label=f"fish {i}", tail_angle=0.2 * i) for i in range(4)]
    frame = whole.frame(moments)
    assert frame.shape == (482, 642, 3)
    alone = view(SETTING, (320, 240)).frame(moments[3])
    np.testing.assert_array_equal(frame[242:, 322:], alone)
    assert not np.array_equal(frame[:240, :320], alone)


def test_functions_of_the_package_stay_functions_after_they_were_used():
    """No module of the package has the name of one of its functions."""
    package = Path(rendering.__file__).parent
    assert not {file.stem for file in package.glob("*.py")} & {*rendering.__all__}
