"""What Gymnasium and Stable-Baselines3 ask of any environment."""

import pickle
import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_match import check_environments_match

from fish_env.envs.registration import ENV_ID, register_envs
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from tests.conformance.cases import ALL_OPTIONS, RICH, random_actions


@pytest.fixture
def strict():
    """Every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.usefixtures("strict")
@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_gymnasium_has_nothing_to_complain_about(options):
    """check_env without a warning, for both tasks and with every option at once."""
    check_env(gym.make(ENV_ID, **options).unwrapped)


@pytest.mark.usefixtures("strict")
@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_stable_baselines3_has_nothing_to_complain_about(options):
    """check_env without a warning, for both tasks and with every option at once."""
    # Here, since `versions --base` runs the rest of the file where there is no PyTorch.
    from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

    check_env_for_sb3(gym.make(ENV_ID, **options), warn=True)


@pytest.mark.usefixtures("strict")
def test_whole_episodes_pass_the_passive_checker():
    """Every step of some episodes, not only the first, has the types and bounds it should."""
    env = gym.make(ENV_ID, **RICH)
    for seed in range(3):
        obs, info = env.reset(seed=seed)
        ended = False
        while not ended:
            assert obs in env.observation_space
            assert obs.dtype == np.float32
            assert all(isinstance(value, float) for value in info.values())
            obs, reward, terminated, truncated, info = env.step(env.action_space.sample())
            assert type(reward) is float
            assert type(terminated) is bool
            assert type(truncated) is bool
            ended = terminated or truncated
    env.close()
    env.close()


CODE = """
import gymnasium, sys
env = gymnasium.make("fish_env:RoboticFish3D-v0")
obs, info = env.reset(seed=3)
print(obs.tobytes().hex(), type(env.unwrapped).__name__, "torch" in sys.modules)
"""


def test_gym_make_imports_the_package_in_a_fresh_process():
    """The module prefix is all that a script needs, and it brings no training library."""
    words = subprocess.run(
        [sys.executable, "-W", "error", "-c", CODE], capture_output=True, text=True, check=True
    ).stdout.split()
    here = gym.make(ENV_ID).reset(seed=3)[0].tobytes().hex()
    assert words == [here, "RoboticFish3DEnv", "False"]


def test_the_spec_says_what_it_should_and_can_be_sent_around():
    """Entry points are strings; a spec, its pickle and its JSON make the same environment."""
    register_envs()  # a second time changes nothing
    spec = gym.make(ENV_ID, task="track", cruise_speed=0.05).spec
    assert isinstance(spec.entry_point, str)
    assert isinstance(spec.vector_entry_point, str)
    assert spec.max_episode_steps == 400
    assert 0 < spec.reward_threshold < spec.max_episode_steps
    assert not spec.nondeterministic
    for copy in (
        pickle.loads(pickle.dumps(spec)),
        gym.envs.registration.EnvSpec.from_json(spec.to_json()),
    ):
        check_environments_match(gym.make(spec), gym.make(copy), 20)


def test_wrapped_and_bare_environments_match():
    """Gymnasium's wrappers change nothing but the time limit."""
    check_environments_match(gym.make(ENV_ID), RoboticFish3DEnv(), 50, skip_truncated=True)


def test_returned_arrays_and_infos_are_the_callers_own():
    """What a caller does to an observation, an action or an info changes nothing later."""
    actions = random_actions(30)
    kept, vandal = RoboticFish3DEnv(**RICH), RoboticFish3DEnv(**RICH)
    kept.reset(seed=1)
    obs, info = vandal.reset(seed=1)
    for action in actions:
        obs[:] = 7.0
        info.clear()
        expected, own = kept.step(action)[0], action.copy()
        obs, _, _, _, info = vandal.step(own)
        own[:] = -1.0
        vandal.state["z"] = 100.0
        vandal.actuators[:] = 1.0
        np.testing.assert_array_equal(obs, expected)


@pytest.mark.parametrize(
    "action", [0.5, np.zeros(1), np.zeros(4), np.zeros((1, 5)), np.full(5, np.nan)]
)
def test_what_is_no_action_is_refused(action):
    """Nothing is broadcast; a NaN means that the policy has diverged, and is said."""
    env = RoboticFish3DEnv()
    env.reset(seed=0)
    with pytest.raises(Exception, match=r"actions have shape \(5,\)|NaN|real numbers"):
        env.step(action)


def test_a_step_needs_a_reset_first():
    """Also without Gymnasium's wrapper, which would catch it."""
    with pytest.raises(Exception, match="call reset"):
        RoboticFish3DEnv().step(np.zeros(5, np.float32))
