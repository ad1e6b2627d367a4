"""Where points fall on the picture, and how the camera follows."""

import numpy as np
import pytest

from fish_env.rendering.camera import CLEARANCE, Camera, Follower

SIZE = (640, 480)


def test_what_is_looked_at_is_in_the_middle_and_right_is_right():
    """From the south looking north, east is to the right and deeper is lower."""
    camera = Camera.looking(np.array([-2.0, 0.0, 0.5]), np.array([0.0, 0.0, 0.5]), SIZE)
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.3, 0.5], [0.0, 0.0, 0.8]])
    pixels, ahead = camera.project(points)
    np.testing.assert_allclose(pixels[0], (320, 240))
    assert pixels[1, 0] > 320
    assert pixels[1, 1] == pytest.approx(240)
    assert pixels[2, 1] > 240
    np.testing.assert_allclose(ahead, 2.0)


def test_twice_as_far_is_half_as_large():
    camera = Camera.looking(np.zeros(3), np.array([1.0, 0.0, 0.0]), SIZE)
    pixels, _ = camera.project(np.array([[1.0, 0.1, 0.0], [2.0, 0.1, 0.0]]))
    assert pixels[0, 0] - 320 == pytest.approx(2 * (pixels[1, 0] - 320))


def followed(rate: int, seconds: float = 2.0) -> Camera:
    """The camera after following a fish that swims east, at this many scenes a second."""
    follower = Follower(0.3)
    for i in range(round(seconds * rate) + 1):
        follower.follow(i / rate, np.array([0.0, 0.1 * i / rate, 0.5]), 0.5)
    return follower.camera(SIZE, 0.0, 1.0)


def test_following_hardly_depends_on_how_often_one_looks():
    assert np.linalg.norm(followed(10).eye - followed(100).eye) < 0.006
    assert np.linalg.norm(followed(10).eye - followed(10, 1.0).eye) > 0.08


def test_the_camera_starts_on_the_fish_and_again_after_a_jump_in_time():
    follower = Follower(0.3)
    follower.follow(3.0, np.array([1.0, 2.0, 0.5]), 0.0)
    first = follower.camera(SIZE, 0.0, 1.0).eye
    follower.follow(3.1, np.array([9.0, 9.0, 0.5]), 0.0)
    assert np.linalg.norm(follower.camera(SIZE, 0.0, 1.0).eye - first) < 6.0
    follower.follow(0.0, np.array([1.0, 2.0, 0.5]), 0.0)
    np.testing.assert_allclose(follower.camera(SIZE, 0.0, 1.0).eye, first)


@pytest.mark.parametrize("depth", [0.05, 0.5, 0.95])
def test_the_eye_stays_in_the_water_until_it_is_moved(depth):
    follower = Follower(0.3)
    follower.follow(0.0, np.array([0.0, 0.0, depth]), 0.0)
    assert CLEARANCE <= follower.camera(SIZE, 0.0, 1.0).eye[2] <= 1.0 - CLEARANCE
    follower.zoom(10.0)
    follower.orbit(0.0, 1.2)
    assert follower.camera(SIZE, 0.0, 1.0).eye[2] < CLEARANCE
    follower.reset()
    assert follower.camera(SIZE, 0.0, 1.0).eye[2] >= CLEARANCE


def test_zoom_and_orbit_have_ends():
    follower = Follower(0.3)
    for _ in range(100):
        follower.zoom(0.5)
        follower.orbit(0.1, 1.0)
    near = follower.distance
    assert 0.2 < near < 0.6
    assert follower.elevation < np.pi / 2
    for _ in range(100):
        follower.zoom(2.0)
    assert near < follower.distance < 10.0
