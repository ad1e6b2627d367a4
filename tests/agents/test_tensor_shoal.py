"""Fish of several conditions as tensors: what policy and critic see is what NumPy makes of it."""

import numpy as np
import pytest
import torch

from robofish_agents.policies.files import PolicyFile
from robofish_agents.policies.history import History, HistorySpec
from robofish_agents.policies.pretrained import PretrainedPolicy
from robofish_agents.training.actor_critic import ActorCritic, Recipe, network_of
from robofish_agents.training.host_env import HostEnv
from robofish_agents.training.privileged import Sight
from robofish_agents.training.tensor_ppo import LIMIT, train
from robofish_agents.training.tensor_shoal import Scale, TensorHistory, TensorShoal

SPEC = HistorySpec(frames=2, low_pass_s=(0.3, 3.0))
NOISY = {
    "task": "track",
    "observation_noise": {"depth": 0.01},
    "randomization": {"mass.buoyancy": {"sd": 1e-3}},
}


def fish(count, longest=400, **options):
    return HostEnv.of_fish(count, max_episode_steps=longest, **options)


@pytest.mark.parametrize("frames", [1, 3])
def test_a_history_of_tensors_is_that_of_arrays(frames):
    spec, rng = HistorySpec(frames, (0.2, 5.0)), np.random.default_rng(0)
    plain, tensors = History(spec, 4, 3), TensorHistory(spec, torch.zeros(4, 3))
    ended = np.ones(4, bool)
    for _ in range(12):
        plain.restart(ended)
        observed = rng.normal(size=(4, 3)).astype(np.float32)
        found = tensors.push(torch.from_numpy(observed), torch.from_numpy(ended))
        assert np.allclose(found.numpy(), plain.push(observed), atol=1e-6)
        ended = rng.uniform(size=4) < 0.3


def test_a_scale_has_the_mean_and_deviation_of_all_that_it_saw():
    rows = np.random.default_rng(1).normal(3.0, [0.1, 20.0], (600, 2)).astype(np.float32)
    scale = Scale(torch.zeros(1, 2))
    for some in np.split(rows, [100, 350]):
        scale.learn(torch.from_numpy(some))
    assert scale.mean.numpy() == pytest.approx(rows.mean(0), rel=1e-5)
    assert scale.deviation().numpy() == pytest.approx(rows.std(0), rel=1e-3)
    normal = scale(torch.from_numpy(rows)).numpy()
    assert np.allclose(normal, (rows - rows.mean(0)) / rows.std(0), atol=1e-2)


def test_the_critic_sees_the_truth_of_all_parts():
    parts = [fish(3, task="track"), fish(2, **NOISY)]
    shoal, sight = TensorShoal(parts, SPEC), Sight([part.batch for part in parts])
    scale = Scale(torch.zeros(1, sight.width))

    def normal():
        known = torch.from_numpy(sight.see(np.concatenate([part.batch.obs for part in parts])))
        scale.learn(known)
        return scale(known)

    _, infos = shoal.reset(seed=4)
    assert torch.allclose(infos["judged"], normal(), atol=1e-4)
    shoal.step(torch.ones(5, 5))
    assert torch.allclose(infos["judged"], normal(), atol=1e-4)


def test_what_the_critic_saw_before_a_step_is_kept():
    shoal = TensorShoal([fish(4, task="track")], SPEC)
    _, infos = shoal.reset(seed=0)
    before = infos["judged"].clone()
    left = shoal.step(torch.ones(4, 5))[4]
    assert torch.equal(left["final_judged"], before)
    assert not torch.equal(infos["judged"], before)


def test_fish_begin_their_later_episodes_in_turn():
    shoal = TensorShoal([fish(16, longest=32)], SPEC)
    shoal.reset(seed=0)
    ended = [shoal.step(torch.zeros(16, 5))[3].sum().item() for _ in range(32)]
    assert sum(ended) == 16
    assert max(ended) == 1


def test_a_judged_shoal_leaves_the_scale_alone():
    shoal = TensorShoal([fish(4)], SPEC)
    shoal.reset(seed=0)
    mean = shoal.seen.mean.clone()
    judge = TensorShoal([fish(3)], SPEC, like=shoal)
    _, infos = judge.reset(seed=1)
    judge.step(torch.ones(3, 5))
    assert torch.equal(shoal.seen.mean, mean)
    assert judge.seen is shoal.seen
    assert not infos


def test_the_policy_file_does_what_the_policy_of_tensors_does():
    shoal = TensorShoal([fish(3), fish(3, **NOISY)], SPEC)
    observed, _ = shoal.reset(seed=2)
    policy = ActorCritic(observed.shape[1], 5, Recipe(layers=(8,)))
    for weights in policy.mean.parameters():
        torch.nn.init.normal_(weights, std=0.3)
    judge_parts = [fish(4, **NOISY)]
    judge = TensorShoal(judge_parts, SPEC, like=shoal)
    observed, _ = judge.reset(seed=5)
    scale = shoal.seen
    network = network_of(policy, scale.mean.numpy(), scale.deviation().numpy(), LIMIT)
    plain = PretrainedPolicy(PolicyFile(network, SPEC, "track", "RoboticFish3D-v0", {}))
    plain.reset(4)
    for _ in range(5):
        wanted = policy.mean(observed).detach().clamp(-1.0, 1.0)
        acted = plain.act(judge_parts[0].batch.obs)
        assert np.allclose(acted, wanted.numpy(), atol=1e-5)
        observed, *_ = judge.step(wanted)


def test_the_critic_of_a_training_judges_the_truth():
    shoal = TensorShoal([fish(32, task="hold")], SPEC)
    recipe = Recipe(iterations=2, steps=4, epochs=1, minibatches=2)
    seen = []
    done = train(shoal, recipe, 0, lambda rollouts, policy: seen.append(rollouts))
    assert seen == [0, 1, 2]
    assert done.steps == 2 * 4 * 32
    _, infos = shoal.reset(seed=0)
    assert done.policy.value(infos["judged"]).shape == (32, 1)
