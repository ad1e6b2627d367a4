"""Policy files: the same numbers as the learner's, safe to load, refused when wrong."""

import io
import json
import math
import pickle
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fish_env.archives import digest
from fish_env.envs.layout import OBSERVATION
from fish_env.errors import ConfigError
from robofish_agents.policies import (
    PolicyFile,
    PretrainedPolicy,
    read_policy,
    shipped,
    write_policy,
)
from robofish_agents.policies.export import export_policy
from robofish_agents.training.config import History, NetworkSettings, Ppo, Sac, TrainConfig
from robofish_agents.training.model import Model, make_model
from robofish_agents.training.stack import Stack, make_stack

SIZE = len(OBSERVATION)


def tiny(algorithm: str = "ppo", activation: str = "tanh") -> TrainConfig:
    return TrainConfig(
        "tiny", algorithm, "hold", 100, num_envs=4, ppo=Ppo(batch_size=256),
        history=History(2, (1.0,)),
        network=NetworkSettings((16, 8), activation),
        sac=Sac(buffer_size=1000, learning_starts=10),
    )  # fmt: skip


def exported(config: TrainConfig) -> tuple[Model, Stack, PolicyFile]:
    """A learner whose normalisation has seen something, and its policy."""
    stack = make_stack(config)
    model = make_model(config, stack)
    stack.outside.reset()
    rng = np.random.default_rng(0)
    for _ in range(20):
        stack.outside.step(rng.uniform(-1, 1, (4, 5)).astype(np.float32))
    spec = stack.past.history.spec
    return model, stack, export_policy(model, stack.outside, spec, config.task, {"seed": 0})


@pytest.fixture(scope="module")
def policy_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("policy") / "policy.npz"
    write_policy(exported(tiny())[2], path)
    return path


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
@pytest.mark.parametrize("activation", ["tanh", "relu"])
def test_actions_equal_the_learners_to_float_precision(algorithm, activation, tmp_path):
    model, stack, policy = exported(tiny(algorithm, activation))
    write_policy(policy, tmp_path / "policy.npz")
    agent = PretrainedPolicy.load(tmp_path / "policy.npz")
    agent.reset(64)
    rng = np.random.default_rng(1)
    for _ in range(5):
        obs = rng.normal(size=(64, SIZE)).astype(np.float32)
        ours = agent.act(obs)
        assert agent._history is not None
        seen = np.concatenate([*agent._history._frames, *agent._history._filters], axis=-1)
        theirs, _ = model.predict(stack.outside.normalize_obs(seen), deterministic=True)
        np.testing.assert_allclose(ours, theirs, atol=2e-6)
        assert ours.dtype == np.float32
        assert ours.shape == (64, 5)


def test_a_batch_is_its_rows(policy_file):
    agent, single = PretrainedPolicy.load(policy_file), PretrainedPolicy.load(policy_file)
    agent.reset(8)
    single.reset(1)
    rng = np.random.default_rng(2)
    for _ in range(4):
        obs = rng.normal(size=(8, SIZE)).astype(np.float32)
        np.testing.assert_allclose(agent.act(obs)[3:4], single.act(obs[3:4]), atol=1e-6)


def test_it_acts_only_after_a_reset(policy_file):
    with pytest.raises(ConfigError, match="reset"):
        PretrainedPolicy.load(policy_file).act(np.zeros((1, SIZE)))


def test_loading_needs_no_torch(policy_file):
    code = (
        "import sys; from robofish_agents.policies import PretrainedPolicy;"
        f"PretrainedPolicy.load({str(policy_file)!r});"
        "assert 'torch' not in sys.modules and 'stable_baselines3' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_is_written_is_read(policy_file, tmp_path):
    policy = read_policy(policy_file)
    write_policy(policy, tmp_path / "again.npz")
    again = read_policy(tmp_path / "again.npz")
    assert again.history == policy.history
    assert again.card == {"seed": 0}
    for one, other in zip(policy.network.weights, again.network.weights, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_truncated_file_is_refused(policy_file, tmp_path, share):
    content = policy_file.read_bytes()
    broken = tmp_path / "broken.npz"
    broken.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ConfigError, match=r"truncated|damaged"):
        read_policy(broken)


def test_every_flipped_byte_is_harmless_or_refused(policy_file, tmp_path):
    """A byte of the archive's own bookkeeping may not matter; a number never changes unseen."""
    content = bytearray(policy_file.read_bytes())
    whole = read_policy(policy_file).network
    broken = tmp_path / "broken.npz"
    refused = 0
    places = np.random.default_rng(3).integers(len(content), size=150)
    for place in places:
        content[place] ^= 0xFF
        broken.write_bytes(content)
        content[place] ^= 0xFF
        try:
            network = read_policy(broken).network
        except ConfigError:
            refused += 1
        else:
            for one, other in zip(whole.weights, network.weights, strict=True):
                np.testing.assert_array_equal(one, other)
    assert refused > 100


@pytest.mark.parametrize(("offset", "value"), [(6, 210), (8, 1)])
def test_an_archive_that_seems_encrypted_or_of_a_later_zip_is_refused(
    policy_file, tmp_path, offset, value
):
    content = bytearray(policy_file.read_bytes())
    content[content.index(b"PK\x01\x02") + offset] = value
    broken = tmp_path / "broken.npz"
    broken.write_bytes(content)
    with pytest.raises(ConfigError, match="damaged"):
        read_policy(broken)


class Trap:
    """Runs code when unpickled."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('code was run')",))


def archive(**members: object) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **{name: np.asarray(value) for name, value in members.items()})
    return buffer.getvalue()


FOREIGN = {
    "a pickle": pickle.dumps({"weights": 1}),
    "a trap": pickle.dumps(Trap()),
    "a trap in an array": archive(about=np.array([Trap()], dtype=object)),
    "text": b"not a policy",
    "other arrays": archive(weights=np.zeros(3)),
    "other json": archive(about=json.dumps({"format": "else"}), digest="0"),
    "no json": archive(about="{", digest="0"),
    "a list": archive(about="[]", digest="0"),
}


@pytest.mark.parametrize("what", FOREIGN)
def test_a_foreign_file_is_refused_and_not_run(what, tmp_path):
    path = tmp_path / "foreign.npz"
    path.write_bytes(FOREIGN[what])
    with pytest.raises(ConfigError, match=str(path)):
        read_policy(path)


def test_an_archive_that_unpacks_to_gigabytes_is_refused(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as bomb:
        bomb.writestr("about.npy", bytes(30_000_000))
    with pytest.raises(ConfigError, match="20 MB"):
        read_policy(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.npz: no such"):
        read_policy(tmp_path / "none.npz")


def test_another_environment_version_is_refused(policy_file, tmp_path):
    policy = replace(read_policy(policy_file), environment="RoboticFish3D-v7")
    write_policy(policy, tmp_path / "later.npz")
    with pytest.raises(ConfigError, match=r"RoboticFish3D-v7.*train it again"):
        read_policy(tmp_path / "later.npz")


@pytest.mark.parametrize("broken", ["nan", "scale", "shape", "activation", "dtype"])
def test_a_network_that_cannot_be_is_refused(policy_file, tmp_path, broken):
    policy = read_policy(policy_file)
    network = policy.network
    bias = network.biases[0]
    wrong = {
        "nan": {"biases": (np.full_like(bias, np.nan), *network.biases[1:])},
        "scale": {"scale": np.zeros_like(network.scale)},
        "shape": {"weights": network.weights[:1] + network.weights[:1] + network.weights[2:]},
        "activation": {"activation": "step"},
        "dtype": {"biases": (bias.astype(float), *network.biases[1:])},
    }[broken]
    write_policy(replace(policy, network=replace(network, **wrong)), tmp_path / "wrong.npz")
    with pytest.raises(ConfigError, match="damaged"):
        read_policy(tmp_path / "wrong.npz")


@pytest.mark.parametrize(
    ("forged", "words"),
    [
        ({"low_pass_s": [math.nan]}, "history.low_pass_s"), ({"frames": 10**9}, "history.frames"),
        ({"period_s": math.nan}, "history.period_s"), ({"limit": math.nan}, "limit of nan"),
        ({"layers": 10**400}, "layers"), ({"card": 5}, "not iterable"),
    ],
)  # fmt: skip
def test_a_forged_description_is_refused_with_its_file(policy_file, tmp_path, forged, words):
    """Its checksum fits: whoever forges a file computes it too."""
    arrays = dict(np.load(policy_file))
    about = json.dumps(json.loads(str(arrays.pop("about"))) | forged, sort_keys=True)
    del arrays["digest"]
    file = tmp_path / "forged.npz"
    np.savez(file, about=np.array(about), digest=np.array(digest(about, arrays)), **arrays)
    with pytest.raises(ConfigError, match=words) as caught:
        read_policy(file)
    assert str(caught.value).startswith(str(file))
    assert len(str(caught.value)) < 500


def test_an_unknown_task_has_no_shipped_policy():
    with pytest.raises(ConfigError, match="juggle"):
        shipped("juggle")


def test_an_untrained_policy_begins_with_the_first_action():
    first = (0.0, 0.8, -0.2, 0.1, 0.0)
    config = tiny()
    config = replace(config, network=replace(config.network, first_action=first))
    network = exported(config)[2].network
    seen = np.random.default_rng(4).normal(size=(10, len(network.mean))).astype(np.float32)
    np.testing.assert_allclose(network(seen), np.tile(first, (10, 1)), atol=0.05)
