"""TorchRL checks the environment, collects with it and takes steps of PPO."""

import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, StepCounter, TransformedEnv, check_env_specs
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from tests.clients.running import ENV


def test_torchrl_has_nothing_to_complain_about():
    env = GymEnv(ENV, task="track")
    check_env_specs(env, seed=0)
    swum = env.rollout(50)
    assert swum["observation"].shape[-1] == 33
    assert swum["action"].shape[-1] == 5


def test_torchrl_takes_steps_of_ppo():
    torch.manual_seed(0)
    env = TransformedEnv(GymEnv(ENV), StepCounter())
    net = nn.Sequential(nn.Linear(33, 32), nn.Tanh(), nn.Linear(32, 10), NormalParamExtractor())
    actor = ProbabilisticActor(
        TensorDictModule(net, ["observation"], ["loc", "scale"]), spec=env.action_spec,
        in_keys=["loc", "scale"], distribution_class=TanhNormal, return_log_prob=True,
    )  # fmt: skip
    critic = ValueOperator(nn.Sequential(nn.Linear(33, 32), nn.Tanh(), nn.Linear(32, 1)))
    collector = Collector(env, actor, frames_per_batch=400, total_frames=800)
    advantage, loss = GAE(gamma=0.99, lmbda=0.95, value_network=critic), ClipPPOLoss(actor, critic)
    before = [p.detach().clone() for p in net.parameters()]
    optimiser, frames = torch.optim.Adam(loss.parameters(), 1e-3), 0
    for batch in collector:
        advantage(batch)
        values = loss(batch)
        total = values["loss_objective"] + values["loss_critic"] + values["loss_entropy"]
        assert torch.isfinite(total).all()
        optimiser.zero_grad()
        total.sum().backward()
        optimiser.step()
        frames += batch.numel()
    collector.shutdown()
    assert frames == 800
    assert any((a != b).any() for a, b in zip(before, net.parameters(), strict=True))
