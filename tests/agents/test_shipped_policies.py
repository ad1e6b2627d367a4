"""The policies in the package: they load, are small, say where they come from, and swim."""

import numpy as np
import pytest
import yaml

from fish_env.envs.registration import ENV_ID
from fish_env.envs.tasks import SIGNAL_TASKS, TASKS
from robofish_agents.evaluation.metrics import success_rate
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.evaluation.suites import load_suite, suite_names
from robofish_agents.policies import Network, PolicyFile, PretrainedPolicy, read_policy, shipped
from robofish_agents.policies.pretrained import SHIPPED

FILES = sorted(SHIPPED.rglob("*.npz"))
NAMES = [str(file.relative_to(SHIPPED)) for file in FILES]


@pytest.mark.parametrize("task", TASKS)
def test_every_task_has_one(task):
    assert shipped(task)
    assert set(shipped(task)) <= set(FILES)


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_a_policy_is_small_and_its_card_is_the_one_inside(file):
    policy = read_policy(file)
    assert file.stat().st_size < 200_000
    card = yaml.safe_load(file.with_suffix(".yaml").read_text(encoding="utf-8"))
    assert card == policy.card
    assert card["environment"] == ENV_ID
    assert {"configuration", "seed", "training", "scores"} <= set(card)


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_scores_are_of_the_suites_as_they_are_now(file):
    suites = read_policy(file).card["scores"]
    for name in suite_names(suites["task"]):
        assert suites[name]["version"] == load_suite(name).version


def succeeded(policy: PolicyFile, task: str, suite: str, episodes: int = 10) -> float:
    record = swim_suite(load_suite(suite), task, PretrainedPolicy(policy), count=episodes)
    return float(np.mean(success_rate(record)))


@pytest.mark.parametrize("task", SIGNAL_TASKS)
def test_the_first_of_a_task_swims_as_its_card_says(task):
    policy = read_policy(shipped(task)[0])
    for suite in ("calm", "noisy"):
        promised = policy.card["scores"][suite]["success_rate"]
        assert succeeded(policy, task, suite) >= promised - 0.3


def test_the_first_for_places_keeps_them():
    policy = read_policy(shipped("station")[0])
    promised = policy.card["scores"]["station/current"]["success_rate"]
    assert succeeded(policy, "station", "station/current") >= promised - 0.3
    unfit = read_policy(shipped("track")[0])
    assert succeeded(unfit, "station", "station/current") < 0.3


def test_a_policy_with_negated_weights_does_not():
    policy = read_policy(shipped("hold")[0])
    network = policy.network
    last = (*network.weights[:-1], -network.weights[-1])
    wrong = Network(
        network.mean, network.scale, network.limit, last, network.biases,
        network.activation, network.output,
    )  # fmt: skip
    broken = PolicyFile(wrong, policy.history, policy.task, policy.environment, policy.card)
    assert succeeded(broken, "hold", "calm") < 0.3
