"""The native vector environment: Gymnasium's contract, and the same bits as single fish."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from fish_env.envs.layout import OBSERVATION, Failure
from fish_env.envs.registration import ENV_ID
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from tests.conformance import checkers
from tests.conformance.cases import ALL_OPTIONS, RICH, START, random_actions

SMALL_TANK = {
    "config": {
        "tank": {"depth": 0.55, "walls": [-0.15, 0.15, -0.15, 0.15]},
        "goal": {"depth": [0.2, 0.35]},
    }
}
"""Where many episodes end at a wall, the surface or the bottom."""
CASES = {**ALL_OPTIONS, "everything in a small tank": {**RICH, **SMALL_TANK}}


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)
@pytest.mark.parametrize("options", CASES.values(), ids=CASES)
def test_a_batch_equals_single_environments(options, mode):
    """All three autoreset modes, both tasks, every option; episodes end and start again."""
    terminated, truncated = checkers.check_vector(RoboticFish3DVectorEnv, 7, mode, options)
    assert terminated + truncated >= 14
    assert truncated > 0
    assert terminated > 0 or options is not CASES["everything in a small tank"]


@pytest.mark.parametrize("count", [1, 16, 37, 300])
def test_the_size_of_a_batch_does_not_change_the_bits(count):
    """One fish, a whole block of lanes, a partly filled one, and enough for two threads."""
    options, mode = {**RICH, **SMALL_TANK}, AutoresetMode.SAME_STEP
    steps = 60 if count < 100 else 30
    ends = checkers.check_vector(RoboticFish3DVectorEnv, count, mode, options, steps)
    assert sum(ends) >= count


@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_threads_do_not_change_the_bits(options):
    """300 fish on one and on two threads."""
    one, two = (RoboticFish3DVectorEnv(300, threads=n, **options) for n in (1, 2))
    np.testing.assert_array_equal(one.reset(seed=1)[0], two.reset(seed=1)[0])
    for row in random_actions(25, lanes=300):
        for a, b in zip(one.step(row)[:4], two.step(row)[:4], strict=True):
            assert a.tobytes() == b.tobytes()


def test_seeds_are_one_or_one_each():
    """seed + i, or the i-th; None goes on with that fish's own generator."""
    env = RoboticFish3DVectorEnv(4)
    by_one = env.reset(seed=10)[0]
    np.testing.assert_array_equal(env.reset(seed=[10, 11, 12, 13])[0], by_one)
    np.testing.assert_array_equal(env.reset(seed=(13, 12, 11, 10))[0], by_one[::-1])
    mixed = env.reset(seed=[10, None, 12, None])[0]
    np.testing.assert_array_equal(mixed[::2], by_one[::2])
    assert not np.any(np.all(mixed[1::2] == by_one[1::2], axis=1))
    again = env.reset()[0]
    assert not np.any(np.all(again == by_one, axis=1))
    with pytest.raises(ConfigError, match="one seed or 4 of them, not 2"):
        env.reset(seed=[1, 2])
    for seed in (-1, np.int64(3)):
        with pytest.raises(gym.error.Error, match="Seed must be"):
            env.reset(seed=seed)


def test_list_seeds_equal_gymnasiums():
    """A list of seeds means what it means to Gymnasium."""
    modes = AutoresetMode.NEXT_STEP, {"task": "hold"}
    checkers.check_vector(RoboticFish3DVectorEnv, 3, *modes, seed=[5, 3, 8])


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)
def test_make_vec_passes_everything_on(mode, recwarn):
    """make_vec makes the native batch, with options, limit and mode, and a spec that makes it."""
    env = gym.make_vec(ENV_ID, num_envs=3, task="track", max_episode_steps=7, autoreset_mode=mode)
    assert type(env) is RoboticFish3DVectorEnv
    assert env.metadata["autoreset_mode"] is mode
    assert RoboticFish3DVectorEnv.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert (env.num_envs, env.options.task) == (3, "track")
    assert gym.make_vec(ENV_ID, num_envs=2).max_episode_steps == 400
    assert env.spec.id == ENV_ID
    assert ENV_ID in repr(env)
    twin = gym.make_vec(pickle.loads(pickle.dumps(env.spec)))
    np.testing.assert_array_equal(twin.reset(seed=1)[0], env.reset(seed=1)[0])
    for _ in range(7):
        *_, truncated, _ = env.step(env.action_space.sample())
    assert truncated.all()
    env.close()
    assert not recwarn.list


def test_modes_may_be_named_by_their_value():
    """Gymnasium takes strings, so we do."""
    env = RoboticFish3DVectorEnv(2, autoreset_mode="SameStep")
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_spaces_and_shapes():
    """Batched spaces contain what comes out; arrays have Gymnasium's types."""
    env = RoboticFish3DVectorEnv(3)
    obs, _ = env.reset(seed=0)
    assert obs in env.observation_space
    assert obs[0] in env.single_observation_space
    assert env.observation_space.shape == (3, len(OBSERVATION))
    obs, reward, terminated, truncated, _ = env.step(env.action_space.sample())
    assert obs in env.observation_space
    assert (reward.dtype, terminated.dtype, truncated.dtype) == (float, bool, bool)
    assert reward.shape == terminated.shape == truncated.shape == (3,)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_episode_statistics_can_be_recorded(mode):
    """Gymnasium's wrapper counts what it counts for its own vector environment."""
    kwargs = {"num_envs": 5, "max_episode_steps": 20}
    ours = RecordEpisodeStatistics(gym.make_vec(ENV_ID, autoreset_mode=mode, **kwargs))
    sync = gym.make_vec(
        ENV_ID, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **kwargs
    )
    theirs = RecordEpisodeStatistics(sync)
    ours.reset(seed=2)
    theirs.reset(seed=2)
    for row in random_actions(65, lanes=5):
        ours.step(row)
        theirs.step(row)
    assert len(ours.return_queue) >= 15
    np.testing.assert_array_equal(ours.return_queue, theirs.return_queue)
    np.testing.assert_array_equal(ours.length_queue, theirs.length_queue)


def test_elapsed_steps_let_episodes_end_in_turn():
    """They shorten the present episode alone."""
    env = RoboticFish3DVectorEnv(3, max_episode_steps=5, autoreset_mode="SameStep")
    env.reset(seed=0)
    env.set_elapsed(np.array([0, 2, 4]))
    ended = [env.step(np.zeros((3, 5), np.float32))[3].tolist() for _ in range(8)]
    expected = [[step in (4,), step in (2, 7), step in (0, 5)] for step in range(8)]
    assert ended == expected


@pytest.mark.parametrize("steps", [[0, 1], [0, -1, 2], [0, 1, 5], [0.0, 1.0, 2.0]])
def test_elapsed_steps_are_those_of_an_episode(steps):
    env = RoboticFish3DVectorEnv(3, max_episode_steps=5)
    with pytest.raises(ConfigError, match="3 whole numbers from 0 to 4"):
        env.set_elapsed(steps)


def test_a_fish_that_fails_at_its_last_step_is_not_truncated():
    """Never both: a learner must not bootstrap through a crash."""
    env = RoboticFish3DVectorEnv(2, max_episode_steps=1)
    state = {"position": [0, 0, 0.9499], "euler": [0, 0, 0], "velocity_body": [0, 0, 0.5]}
    env.reset(seed=0, options={"state": state})
    _, _, terminated, truncated, infos = env.step(np.zeros((2, 5), np.float32))
    assert terminated.all()
    assert not truncated.any()
    assert np.all(infos["failure"] == Failure.BOTTOM)


def test_masks_and_arrays_are_the_callers_own():
    """Writing into a returned info or observation changes neither its neighbours nor the batch."""
    env, twin = (RoboticFish3DVectorEnv(3) for _ in range(2))
    obs, infos = env.reset(seed=0)
    twin.reset(seed=0)
    infos["_depth"][0] = False
    assert infos["_heading"][0]
    infos["depth"][:] = 9.0
    obs[:] = 9.0
    row = random_actions(1, lanes=3)[0]
    np.testing.assert_array_equal(env.step(row)[0], twin.step(row)[0])


def test_reset_options_hold_for_every_fish_and_for_that_episode():
    """As for the single environment; automatic resets draw again."""
    env = RoboticFish3DVectorEnv(3, max_episode_steps=3, autoreset_mode="SameStep")
    _, infos = env.reset(seed=0, options=START)
    assert np.all(infos["goal_depth"] == 0.5)
    assert np.all(infos["depth"] == 0.5)
    for _ in range(3):
        *_, infos = env.step(np.zeros((3, 5), np.float32))
    assert len(set(infos["goal_depth"])) == 3


REFUSED = [
    ({"reset_mask": [True, False]}, "shape"),
    ({"reset_mask": np.zeros(3, bool)}, "not all False"),
    ({"reset_mask": np.ones(3)}, "boolean"),
]


@pytest.mark.parametrize(("options", "message"), REFUSED)
def test_wrong_masks_are_refused(options, message):
    """A mask is (num_envs,) bool with something in it."""
    env = RoboticFish3DVectorEnv(3)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=message):
        env.reset(options=options)


def test_misuse_is_refused():
    """Steps before a reset, beyond an end, of a wrong shape, of NaN; batches of nothing."""
    env = RoboticFish3DVectorEnv(2, autoreset_mode="Disabled", max_episode_steps=1)
    zeros = np.zeros((2, 5), np.float32)
    with pytest.raises(ConfigError, match="call reset"):
        env.step(zeros)
    with pytest.raises(ConfigError, match="first reset must be of all"):
        env.reset(options={"reset_mask": np.array([True, False])})
    env.reset(seed=0)
    for wrong in (np.zeros(5), np.zeros((2, 1)), 0.0, np.zeros((3, 5))):
        with pytest.raises(ConfigError, match="actions have shape"):
            env.step(wrong)
    with pytest.raises(ConfigError, match="1 action values are NaN"):
        env.step(np.array([[0, 0, 0, 0, 0], [0, np.nan, 0, 0, 0]]))
    env.reset(seed=0)
    env.step(zeros)
    with pytest.raises(ConfigError, match=r"fish \[0, 1\] have ended"):
        env.step(zeros)
    for wrong in ({"num_envs": 0}, {"max_episode_steps": 0}):
        with pytest.raises(ConfigError, match="at least 1"):
            RoboticFish3DVectorEnv(**wrong)


@pytest.mark.parametrize("options", CASES.values(), ids=CASES)
def test_many_random_steps_without_a_nan(options):
    """200,000 steps of fish that crash, tumble and start again."""
    env = RoboticFish3DVectorEnv(512, **options)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    ends = 0
    for _ in range(410):
        actions = rng.uniform(-1, 1, (512, 5)).astype(np.float32)
        obs, reward, terminated, truncated, infos = env.step(actions)
        assert np.all(np.isfinite(obs))
        assert np.all(np.abs(obs) <= 10)
        assert np.all((reward <= 1) & (reward >= -0.1))
        assert all(np.all(np.isfinite(infos[key])) for key in infos if infos[key].dtype == float)
        ends += int((terminated | truncated).sum())
    assert ends >= 512
