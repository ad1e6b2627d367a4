"""RLlib trains on the native batch: resumed to the bit, and its policies are ordinary ones."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import torch
import yaml

pytest.importorskip("ray", reason="needs the extra `ray`: make ray")

from ray.rllib.core.columns import Columns

from fish_env.cluster import ClusterSettings
from fish_env.errors import ConfigError
from robofish_agents.evaluation.results import evaluate
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies import PretrainedPolicy, read_policy
from robofish_agents.registry import load_agents
from robofish_agents.sweep.plan import plan
from robofish_agents.sweep.run import FINISHED, run_sweep
from robofish_agents.training.engines import make_engine
from robofish_agents.training.run import CHECKPOINT, train
from robofish_agents.training.stack import make_stack, seed_episodes
from tests.agents.test_training import PPO, Quiet, same

CONFIG = replace(PPO, engine="rllib")
PLAIN = replace(CONFIG, imitate=replace(PPO.imitate, rounds=0))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return train(CONFIG, tmp_path_factory.mktemp("whole"), Quiet())


@pytest.fixture
def engine():
    """A learner before its first step, and its fish."""
    stack = make_stack(PLAIN)
    made = make_engine(PLAIN, stack)
    seed_episodes(stack, PLAIN)
    yield made, stack
    made.close()


@pytest.mark.parametrize("stop_at", [100, 1000, 1999])
def test_a_stopped_training_goes_on_to_the_same_bits(stop_at, whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(CONFIG, tmp_path, Quiet(stop_at))
    resumed = train(CONFIG, tmp_path, Quiet(), resume=True)
    assert same(resumed, whole)
    assert resumed.progress.steps == whole.progress.steps == 2048


def test_another_seed_and_another_engine_learn_something_else(whole, tmp_path):
    assert not same(train(replace(CONFIG, seed=1), tmp_path / "seed", Quiet()), whole)
    assert not same(train(PPO, tmp_path / "engine", Quiet()), whole)


def test_learning_begins_with_the_networks_of_stable_baselines3(engine):
    made, _ = engine
    stack = make_stack(PLAIN)
    other = make_engine(replace(PLAIN, engine="sb3"), stack)
    one, two = made.policy({}).network, other.policy({}).network
    pairs = zip((*one.weights, *one.biases), (*two.weights, *two.biases), strict=True)
    assert all(np.array_equal(a, b) for a, b in pairs)


def test_each_control_step_steps_the_batch_once(engine, monkeypatch):
    """No fish is stepped alone."""
    made, stack = engine
    stepped = []
    wait = stack.fish.step_wait
    monkeypatch.setattr(stack.fish, "step_wait", lambda: stepped.append(1) or wait())
    pieces = made.runner.sample()
    assert len(stepped) == PLAIN.ppo.n_steps
    assert sum(map(len, pieces)) == PLAIN.ppo.n_steps * PLAIN.num_envs


def test_episodes_are_cut_where_they_end(engine):
    """What the learner gets is what the batch did: ends, kinds of ends, and last observations."""
    made, stack = engine
    stack.fish.parts[0].env.max_episode_steps = 5
    pieces = made.runner.sample()
    short = [piece for piece in pieces if len(piece) == 5]
    assert len(short) == 3 * stack.fish.parts[0].num_envs, "three times in 16 steps"
    assert all(piece.is_truncated and not piece.is_terminated for piece in short)
    first, second = short[0], short[1]
    seen = first.get_observations()
    assert seen.shape == (6, *stack.outside.observation_space.shape)
    assert not np.array_equal(seen[-1], second.get_observations(0)), "not that of the next"
    whole = [piece for piece in pieces if len(piece) == PLAIN.ppo.n_steps]
    assert not any(piece.is_done for piece in whole), "these go on"
    logits = torch.as_tensor(first.get_extra_model_outputs(Columns.ACTION_DIST_INPUTS))
    again = made.runner.module.forward_exploration({Columns.OBS: torch.as_tensor(seen[:-1])})
    assert torch.allclose(again[Columns.ACTION_DIST_INPUTS], logits, atol=1e-6)


def test_the_policy_is_an_ordinary_one(whole):
    file = read_policy(whole.policy)
    assert file.card["configuration"]["engine"] == "rllib"
    assert file.card["made_with"]["ray"]
    name = str(whole.policy)
    result = evaluate(name, load_agents(name, "hold"), load_suite("calm"), "hold", 2)
    assert result is not None


def test_the_policy_file_gives_the_actions_of_the_networks(whole, tmp_path):
    """In float precision, by the checkpoint of the same step."""
    stack = make_stack(CONFIG)
    made = make_engine(CONFIG, stack)
    try:
        file = made.policy({})
        raw = np.random.default_rng(0).normal(size=(50, len(file.network.mean)))
        normal = stack.outside.normalize_obs(raw).astype(np.float32)
        out = made.runner.module.forward_inference({Columns.OBS: torch.as_tensor(normal)})
        mean = out[Columns.ACTION_DIST_INPUTS][:, :5].detach().numpy()
        policy = PretrainedPolicy(file).policy.network
        np.testing.assert_allclose(policy(raw), np.clip(mean, -1, 1), atol=1e-5)
    finally:
        made.close()


def test_a_checkpoint_holds_arrays_and_json_alone(whole):
    with zipfile.ZipFile(whole.policy.parent / CHECKPOINT) as archive:
        for name in archive.namelist():
            array = np.load(io.BytesIO(archive.read(name)), allow_pickle=False)
            assert not array.dtype.hasobject


def test_a_checkpoint_of_the_other_engine_is_refused(whole):
    with pytest.raises(ConfigError, match="engine was 'rllib', is 'sb3'"):
        train(PPO, whole.policy.parent, Quiet(), resume=True)


def test_a_sweep_may_try_both_engines(tmp_path):
    short = replace(PPO, total_steps=512, imitate=replace(PPO.imitate, rounds=0))
    file = tmp_path / "tiny.yaml"
    file.write_text(yaml.safe_dump(short.tree()))
    rows = run_sweep(plan(file, "0", ["engine=sb3,rllib"]), tmp_path / "out", ClusterSettings())
    assert [row["state"] for row in rows] == [FINISHED] * 2
