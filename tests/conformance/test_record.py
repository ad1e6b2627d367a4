"""A recorded episode replays to the bit, and says when it cannot."""

import json
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction

import fish_env  # noqa: F401  (registers the environment)
from fish_env.archives import digest
from fish_env.envs.record import EpisodeRecorder, read_episode, replay_episode
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, OutputError
from fish_env.params import load_fish
from tests.conformance.cases import ALL_OPTIONS, RICH, STILL, random_actions

STEPS = 25


def record(file, actions=None, seed=3, reset=None, episodes=1, **options):
    env = EpisodeRecorder(gym.make("RoboticFish3D-v0", **options))
    for episode in range(episodes):
        env.reset(seed=seed if episode == 0 else None, options=reset)
        for action in random_actions(STEPS, seed=episode) if actions is None else actions:
            env.step(action)
    env.save(file)
    return env.episode


def forge(file, **changes):
    """The same file with another description and a right checksum."""
    with np.load(file) as members:
        arrays = {name: members[name] for name in members.files}
    about = json.loads(str(arrays.pop("about"))) | changes
    document = json.dumps(about)
    arrays["digest"] = np.array(
        digest(document, {name: a for name, a in arrays.items() if name != "digest"})
    )
    np.savez(file, about=np.array(document), **arrays)


@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_an_episode_replays_to_the_bit(options, tmp_path):
    """Also one that began without a seed, after another, and with options of its own."""
    record(tmp_path / "e.npz", episodes=2, reset={"state": STILL}, **options)
    again = replay_episode(tmp_path / "e.npz")
    assert again.exact
    assert len(again.replayed.rewards) == STEPS
    assert again.recorded.about["reset"]["seed"] is None


def test_it_replays_in_another_process(tmp_path):
    record(tmp_path / "e.npz", **RICH)
    code = (
        "import sys; from fish_env.envs.record import replay_episode;"
        "print(replay_episode(sys.argv[1]).exact)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "e.npz"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "True"


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("lanes", [4, 37])
def test_it_replays_in_a_batch(lanes, threads, tmp_path):
    """Any fish of a batch of any size, on any number of threads, swims the recorded episode."""
    seen = record(tmp_path / "e.npz", seed=10, **RICH)
    env = RoboticFish3DVectorEnv(lanes, threads=threads, **RICH)
    lane = 3
    env.reset(seed=10 - lane)
    for i, action in enumerate(seen.actions):
        obs, reward, terminated, *_ = env.step(np.tile(action, (lanes, 1)))
        assert obs[lane].tobytes() == seen.observations[i + 1].tobytes()
        assert reward[lane] == seen.rewards[i]
        if terminated[lane]:
            break


def test_the_time_limit_is_recorded(tmp_path):
    seen = record(tmp_path / "e.npz", random_actions(5), max_episode_steps=5)
    assert seen.truncated.tolist() == [False] * 4 + [True]
    assert replay_episode(tmp_path / "e.npz").exact


def test_another_action_is_noticed_where_it_differs(tmp_path):
    """The comparison can tell two episodes apart, by the last bit of one reward too."""
    file = tmp_path / "e.npz"
    seen = record(file)
    rewards = seen.rewards.copy()
    rewards[7] = np.nextafter(rewards[7], 1.0)
    numbers = {n: getattr(seen, n) for n in ("actions", "observations", "terminated", "truncated")}
    document = json.dumps(dict(seen.about))
    checksum = digest(document, numbers | {"rewards": rewards})
    np.savez(file, about=np.array(document), digest=np.array(checksum), rewards=rewards, **numbers)
    assert replay_episode(file).differs_at == 8


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"environment": "RoboticFish3D-v1"}, "recorded in RoboticFish3D-v1"),
        ({"package": "0.0.9"}, "robotic-fish 0.0.9"),
        ({"physics": "0123456789abcdef"}, "other physics"),
        ({"model": "0123456789abcdef"}, "give the right fish with fish="),
        ({"format": "robofish-episode-9"}, "no recorded episode"),
        ({"options": {"task": "hold", "nonsense": 1}}, "record it again"),
        ({"reset": {"seed": 0}}, "record it again"),
        ({"max_episode_steps": -4}, "max_episode_steps -4"),
    ],
)
def test_another_version_is_noticed(changes, words, tmp_path):
    file = tmp_path / "e.npz"
    record(file)
    forge(file, **changes)
    with pytest.raises(ConfigError, match=words) as caught:
        replay_episode(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_another_version_can_be_tried(tmp_path):
    file = tmp_path / "e.npz"
    record(file)
    forge(file, package="0.0.9", physics="x")
    assert replay_episode(file, any_version=True).exact


def test_an_edited_fish_is_noticed(tmp_path):
    fish, file = tmp_path / "mine.yaml", tmp_path / "e.npz"
    fish.write_text("base: zheng-2021-a\nname: mine\n")
    record(file, fish=str(fish))
    assert replay_episode(file).exact
    fish.write_text("base: zheng-2021-a\nname: mine\nmass: {buoyancy: 2.001}\n")
    with pytest.raises(ConfigError, match="fish="):
        replay_episode(file)
    again = replay_episode(file, any_version=True)
    assert again.differs_at is not None


def test_a_fish_in_memory_is_given_again(tmp_path):
    file = tmp_path / "e.npz"
    fish = load_fish("zheng-2021-a").replace({"mass.buoyancy": 2.001})
    record(file, fish=fish)
    with pytest.raises(ConfigError, match="fish="):
        replay_episode(file)
    assert replay_episode(file, fish=fish).exact


def test_a_file_cannot_say_that_it_is_trusted(tmp_path):
    file = tmp_path / "e.npz"
    record(file, trust_effects=True)
    assert "trust_effects" not in read_episode(file).about["options"]
    forge(file, options={"trust_effects": True})
    with pytest.raises(ConfigError, match="record it again"):
        replay_episode(file)


def test_a_damaged_file_is_refused(tmp_path):
    file = tmp_path / "e.npz"
    record(file)
    content = file.read_bytes()
    for damaged in (content[:-40], content[: len(content) // 2], b"", content[:300] + b"x" * 50):
        file.write_bytes(damaged)
        with pytest.raises(ConfigError, match=r"e\.npz"):
            read_episode(file)
    with pytest.raises(ConfigError, match="no such file"):
        read_episode(tmp_path / "none.npz")


def test_what_cannot_be_recorded_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="RescaleAction"):
        EpisodeRecorder(RescaleAction(gym.make("RoboticFish3D-v0"), -2.0, 2.0))
    with pytest.raises(ConfigError, match=r"gymnasium\.make"):
        EpisodeRecorder(RoboticFish3DEnv())
    env = EpisodeRecorder(gym.make("RoboticFish3D-v0"))
    with pytest.raises(ConfigError, match="reset"):
        env.save(tmp_path / "e.npz")
    env.reset(seed=0)
    with pytest.raises(OutputError):
        env.save(tmp_path)
