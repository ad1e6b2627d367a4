"""What pictures show as the path or place is what guidance measures distances from."""

import numpy as np
import pytest

from fish_env.envs.outline import outline
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.tasks.path import SHAPES

STILL = np.array([0, -1, -1, 0, 0], np.float32)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_fish_on_the_drawn_path_is_on_the_path(shape, seed):
    """Carried along the drawn points it has no error, and its progress ends at 1."""
    share = {name: float(name == shape) for name in SHAPES}
    env = RoboticFish3DEnv(task="path", config={"goal": {"path": {"share": share}}})
    env.reset(seed=seed)
    points = outline(env._batch, 0)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 0.06
    progress = []
    for point in points:
        env._batch.state[:3, 0] = point
        env._batch.state[7:13, 0] = 0.0
        info = env.step(STILL)[4]
        assert info["cross_track_error"] == pytest.approx(0.0, abs=1e-3)
        assert info["goal_depth"] == pytest.approx(point[2], abs=2e-3)
        progress.append(info["path_progress"])
    assert np.all(np.diff(progress) > -1e-6)
    assert (progress[0], progress[-1]) == pytest.approx((0.0, 1.0), abs=1e-3)


def test_a_place_is_shown_as_the_ring_of_its_tolerance():
    env = RoboticFish3DEnv(task="station")
    env.reset(seed=0, options={"goal": {"north": 0.4, "east": -0.2, "depth": 0.5}})
    ring = env.scene().path
    np.testing.assert_allclose(np.linalg.norm(ring - [0.4, -0.2, 0.5], axis=1), 0.45)


@pytest.mark.parametrize("task", ["hold", "track"])
def test_other_tasks_show_none(task):
    env = RoboticFish3DEnv(task=task)
    env.reset(seed=0)
    assert env.scene().path.shape == (0, 3)
