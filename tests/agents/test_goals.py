"""The PID follows every path and keeps places, as does a policy that was trained on `track`."""

import numpy as np
import pytest

from fish_env.envs.config import load_env_config
from fish_env.envs.tasks.path import SHAPES
from fish_env.envs.vector import RoboticFish3DVectorEnv
from robofish_agents.registry import load_agents

SUCCESS = load_env_config().tree["success"]
COUNT, STEPS, LATE = 12, 600, 100


def swum(task, agent="pid", steps=STEPS, **options):
    """Infos over time, key -> (steps, COUNT), of an agent on a task."""
    env = RoboticFish3DVectorEnv(COUNT, task=task, max_episode_steps=steps + 1, **options)
    observations, _ = env.reset(seed=21)
    (swimmer, *_) = load_agents(agent, task)
    swimmer.reset(COUNT)
    infos = []
    for _ in range(steps):
        observations, _, terminated, _, info = env.step(swimmer.act(observations))
        assert not terminated.any()
        infos.append(info)
    return {key: np.array([info[key] for info in infos]) for key in infos[0]}


def only(shape):
    return {"goal": {"path": {"share": {name: float(name == shape) for name in SHAPES}}}}


@pytest.mark.parametrize("agent", ["pid", "pretrained"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_path_is_followed(shape, agent):
    """Within the tolerances at the end, forwards all the way."""
    infos = swum("path", agent, config=only(shape))
    assert np.abs(infos["cross_track_error"][-LATE:]).max() < SUCCESS["cross_track"]
    assert np.abs(infos["depth_error"][-LATE:]).max() < SUCCESS["depth"]
    assert np.all(infos["is_success"][-1] == 1.0)
    progress = infos["path_progress"]
    assert np.all(np.diff(progress[LATE:], axis=0) >= -1e-4)
    assert progress[-1].min() > 0.4


def test_a_path_is_followed_in_a_current_that_nobody_tells_of():
    """Its integral takes out the better part of what the current makes."""
    off = {}
    for integral in (0.0, 0.06):
        config = {"goal": {"path": {"guidance": {"integral": integral}}}}
        infos = swum("path", config=config, current=(0.0, 0.02, 0.0))
        off[integral] = np.sqrt(np.mean(infos["cross_track_error"][-LATE:] ** 2))
    assert off[0.06] < 0.7 * off[0.0]
    assert off[0.06] < SUCCESS["cross_track"]


def test_a_place_is_kept_in_still_water():
    """By circling around it, within 1.5 body lengths."""
    infos = swum("station")
    assert np.all(infos["place_error"][-LATE:] < SUCCESS["place"])
    assert np.all(infos["is_success"][-1] == 1.0)


def test_a_place_is_kept_against_a_current():
    """With the head against it, within a hand's breadth of the place."""
    infos = swum("station", steps=600, current=(0.0, 0.05, 0.0))
    assert np.median(infos["place_error"][-1]) < 0.1
    assert np.all(infos["is_success"][-1] == 1.0)
    assert np.median(np.abs(infos["heading"][-1] + np.pi / 2)) < 0.2


def test_success_counts_the_place_alone():
    infos = swum("station", steps=400)
    inside = infos["place_error"] <= SUCCESS["place"]
    np.testing.assert_array_equal(infos["within_tolerance_s"] > 0, inside)
