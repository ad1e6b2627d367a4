"""Same seed, same bits: anew, in another process, from a pickle, from a copy."""

import copy
import pickle
import random
import subprocess
import sys

import numpy as np
import pytest

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from tests.conformance import checkers
from tests.conformance.cases import ALL_OPTIONS, RICH, random_actions


@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_same_seed_same_bits(options):
    """Two environments, two episodes each, the second without a seed; another seed differs."""
    checkers.check_determinism(lambda: RoboticFish3DEnv(**options))


CODE = """
from tests.conformance import checkers
from tests.conformance.cases import RICH
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
print(checkers.fingerprint(RoboticFish3DEnv(**RICH), 5))
"""


def test_another_process_gives_the_same_bits():
    """Nothing depends on hash seeds, on compiling afresh or on what ran before."""
    there = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True
    ).stdout.strip()
    assert there == checkers.fingerprint(RoboticFish3DEnv(**RICH), 5)


@pytest.mark.parametrize("duplicate", [lambda e: pickle.loads(pickle.dumps(e)), copy.deepcopy])
@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_a_copy_made_within_an_episode_goes_on_alike(options, duplicate):
    """Pickle and deepcopy carry delays, noise, draws to come; the two do not share anything."""
    env = RoboticFish3DEnv(**options)
    env.reset(seed=11)
    actions = random_actions(60)
    for action in actions[:17]:
        env.step(action)
    twin = duplicate(env)
    ahead = [twin.step(action) for action in actions[17:]]
    behind = [env.step(action) for action in actions[17:]]
    for (obs, reward, *_), (other, again, *_) in zip(ahead, behind, strict=True):
        assert obs.tobytes() == other.tobytes()
        assert reward == again
    assert env.reset()[0].tobytes() == twin.reset()[0].tobytes()


@pytest.mark.parametrize("duplicate", [lambda e: pickle.loads(pickle.dumps(e)), copy.deepcopy])
def test_a_copy_of_a_batch_goes_on_alike(duplicate):
    """The vector environment can be kept in a checkpoint too."""
    env = RoboticFish3DVectorEnv(5, **RICH)
    env.reset(seed=11)
    actions = random_actions(60, lanes=5)
    for row in actions[:17]:
        env.step(row)
    twin = duplicate(env)
    for row in actions[17:]:
        ahead, behind = twin.step(row), env.step(row)
        for a, b in zip(ahead[:4], behind[:4], strict=True):
            assert a.tobytes() == b.tobytes()


def test_global_generators_are_neither_read_nor_advanced():
    """A script's own np.random and random stay its own."""

    def episode():
        env, batch = RoboticFish3DEnv(**RICH), RoboticFish3DVectorEnv(3, **RICH)
        obs = [env.reset(seed=1)[0], *batch.reset(seed=1)[0]]
        obs += [env.step(action)[0] for action in random_actions(20)]
        return np.array(obs)

    def state():
        return np.random.get_state()[1].tobytes(), random.getstate()  # noqa: NPY002

    np.random.seed(1)  # noqa: NPY002
    random.seed(1)
    before = state()
    first = episode()
    assert state() == before
    np.random.seed(2)  # noqa: NPY002
    np.testing.assert_array_equal(episode(), first)


def test_without_a_seed_episodes_differ():
    """Two unseeded environments do not start alike."""
    first, second = (RoboticFish3DEnv().reset()[0] for _ in range(2))
    assert not np.array_equal(first, second)
