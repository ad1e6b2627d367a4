"""The environments draw what they do, and do nothing else for it."""

import copy
import pickle
import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVideos
from imageio_ffmpeg import count_frames_and_secs

from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.sb3 import FishVecEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, MissingExtraError
from tests.conformance.cases import RICH, random_actions, run

SMALL = {"render_size": (64, 48)}


@pytest.fixture(autouse=True)
def strict():
    """Every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("mode", [None, "rgb_array", "human"])
def test_gymnasium_has_nothing_to_complain_about(mode):
    """With each mode, and with None, which makes it try all of them."""
    env = gym.make(ENV_ID, render_mode=mode, **SMALL)
    assert env.metadata["render_modes"] == ["human", "rgb_array"]
    assert env.metadata["render_fps"] == 10
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("options", [{}, RICH], ids=["plain", "everything"])
@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_drawing_changes_no_bit_of_the_motion(mode, options, monkeypatch):
    monkeypatch.setattr("fish_env.rendering.windows.FRAMES_S", 1000)
    actions = random_actions(12)
    expected = run(RoboticFish3DEnv(**options), actions)
    drawn = RoboticFish3DEnv(render_mode=mode, **SMALL, **options)
    obs, info = drawn.reset(seed=0)
    seen, rewards, infos = [obs], [], [info]
    for action in actions:
        drawn.render()
        obs, reward, _, _, info = drawn.step(action)
        seen.append(obs)
        rewards.append(reward)
        infos.append(info)
    drawn.close()
    np.testing.assert_array_equal(seen, expected[0])
    np.testing.assert_array_equal(rewards, expected[1])
    assert infos == expected[2]


def test_the_scene_is_the_state():
    env = RoboticFish3DEnv(render_mode="rgb_array", **SMALL)
    run(env, random_actions(5))
    scene, state = env.scene(), env.state
    np.testing.assert_array_equal(scene.position, [state[axis] for axis in "xyz"])
    assert scene.speed == state["u"]
    np.testing.assert_array_equal(scene.actuators, env.actuators)
    assert scene.tail_angle == scene.commanded_tail
    assert scene.wake.shape == (5, 3)
    np.testing.assert_array_equal(scene.wake[0], [0.0, 0.0, scene.wake[0, 2]])
    env.reset(seed=1)
    assert env.scene().wake.shape == (0, 3)


def test_a_servo_that_lags_is_seen_to():
    """The tail is drawn where it is, not where it is told to be."""
    env = RoboticFish3DEnv(effects={"servo_lag": {"time_constant": 0.08}}, action_delay_s=0.0)
    run(env, random_actions(20))
    scene = env.scene()
    assert abs(scene.tail_angle - scene.commanded_tail) > 1e-3


def test_what_a_scene_holds_does_not_change_afterwards():
    env = RoboticFish3DEnv(render_mode="rgb_array", **SMALL)
    run(env, random_actions(3))
    scene = env.scene()
    kept = copy.deepcopy(scene)
    env.step(random_actions(1)[0])
    for name in ("position", "quaternion", "actuators", "wake"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(kept, name))


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_copies_are_made_without_the_window(mode):
    env = RoboticFish3DEnv(render_mode=mode, **SMALL)
    env.reset(seed=0)
    env.render()
    action = random_actions(1)[0]
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert not twin.window_open
        np.testing.assert_array_equal(twin.step(action)[0], copy.deepcopy(env).step(action)[0])
        twin.close()
    assert env.window_open == (mode == "human")
    env.close()
    assert not env.window_open
    env.close()


@pytest.mark.parametrize("make", [RoboticFish3DEnv, RoboticFish3DVectorEnv])
def test_a_picture_needs_a_reset_first(make):
    env = make(render_mode="rgb_array")
    with pytest.raises(ConfigError, match="call reset"):
        env.render()


@pytest.mark.parametrize("size", [(640,), (640.0, 480.0), (4, 480), (640, 10_000), "large"])
def test_sizes_that_cannot_be_are_refused(size):
    with pytest.raises(ConfigError, match="render_size"):
        RoboticFish3DEnv(render_size=size)


@pytest.mark.parametrize("make", [RoboticFish3DEnv, RoboticFish3DVectorEnv])
def test_what_is_missing_is_named_at_once(make, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingExtraError, match=r"pip install .*pygame-ce"):
        make(render_mode="rgb_array")
    make()


def test_the_other_pygame_is_not_taken_for_ours(monkeypatch):
    monkeypatch.delattr("pygame.IS_CE")
    with pytest.raises(MissingExtraError, match="pip uninstall pygame"):
        RoboticFish3DEnv(render_mode="rgb_array")


def test_an_environment_that_draws_nothing_loads_no_pygame():
    code = (
        "import sys, gymnasium; env = gymnasium.make('fish_env:RoboticFish3D-v0'); "
        "env.reset(seed=0); env.unwrapped.scene(); print('pygame' in sys.modules)"
    )
    words = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert words.stdout.split() == ["False"]


def test_nothing_is_written_to_the_terminal_for_drawing():
    code = (
        "import gymnasium; "
        "env = gymnasium.make('fish_env:RoboticFish3D-v0', render_mode='rgb_array'); "
        "env.reset(seed=0); env.render()"
    )
    words = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert words.stdout == ""


def test_gymnasium_records_a_video(tmp_path):
    env = gym.make(ENV_ID, render_mode="rgb_array", **SMALL)
    env = RecordVideo(env, str(tmp_path / "films"), episode_trigger=lambda episode: episode == 0)
    env.reset(seed=0)
    for action in random_actions(7):
        env.step(action)
    env.close()
    [file] = tmp_path.glob("films/*.mp4")
    # moviepy may leave out the last frame.
    assert count_frames_and_secs(str(file))[0] in (7, 8)


def test_gymnasium_records_a_video_of_a_batch(tmp_path):
    envs = gym.make_vec(ENV_ID, num_envs=4, render_mode="rgb_array", **SMALL)
    envs = RecordVideos(envs, str(tmp_path / "films"), episode_trigger=lambda episode: episode == 0)
    envs.reset(seed=0)
    for actions in random_actions(5, lanes=4):
        envs.step(actions)
    envs.close()
    [file] = tmp_path.glob("films/*.mp4")
    assert count_frames_and_secs(str(file))[0] in (5, 6)


def test_a_mosaic_shows_the_first_fish():
    envs = gym.make_vec(ENV_ID, num_envs=5, render_mode="mosaic", render_count=4, **SMALL)
    envs.reset(seed=0)
    frame = envs.render()
    assert frame.shape == (48, 64, 3)
    assert frame.dtype == np.uint8
    alone = gym.make_vec(ENV_ID, num_envs=5, render_mode="rgb_array", render_size=(31, 23))
    alone.reset(seed=0)
    np.testing.assert_array_equal(
        alone.unwrapped.scene(3).position, envs.unwrapped.scene(3).position
    )
    assert len(alone.render()) == 5


@pytest.mark.parametrize("mode", ["mosaic", "rgb_array", "human"])
def test_drawing_changes_no_bit_of_a_batch(mode, monkeypatch):
    monkeypatch.setattr("fish_env.rendering.windows.FRAMES_S", 1000)
    plain = RoboticFish3DVectorEnv(3, max_episode_steps=4)
    drawn = RoboticFish3DVectorEnv(3, max_episode_steps=4, render_mode=mode, **SMALL)
    plain.reset(seed=0)
    drawn.reset(seed=0)
    for actions in random_actions(9, lanes=3):
        drawn.render()
        expected, result = plain.step(actions), drawn.step(actions)
        for one, other in zip(expected[:4], result[:4], strict=True):
            np.testing.assert_array_equal(one, other)
    drawn.close()
    drawn.close()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_new_episode_begins_without_a_wake(mode):
    envs = RoboticFish3DVectorEnv(
        2, max_episode_steps=4, autoreset_mode=mode, render_mode="mosaic", **SMALL
    )
    envs.reset(seed=0)
    lengths = []
    for actions in random_actions(7, lanes=2):
        envs.step(actions)
        lengths.append(len(envs.scene(1).wake))
    assert lengths == ([1, 2, 3, 4, 0, 1, 2] if mode == "NextStep" else [1, 2, 3, 0, 1, 2, 3])


def test_stable_baselines3_gets_its_pictures():
    env = FishVecEnv(4, render_mode="rgb_array", **SMALL)
    env.reset()
    assert [image.shape for image in env.get_images()] == [(48, 64, 3)] * 4
    assert env.render().shape == (96, 128, 3)
    env.close()
