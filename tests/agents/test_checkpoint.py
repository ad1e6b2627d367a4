"""Checkpoints hold plain values: all that a training needs, and nothing that could run."""

import ast
import io
import json
import os
import pickle
import random
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from fish_env.errors import ConfigError
from robofish_agents.training.checkpoint import FORMAT, Progress, load_checkpoint, save_checkpoint
from robofish_agents.training.config import Ppo, Sac, TrainConfig
from robofish_agents.training.learner_state import learner_state, restore_learner
from robofish_agents.training.model import make_model
from robofish_agents.training.plain import read_plain, write_plain
from robofish_agents.training.run import CHECKPOINT, train
from robofish_agents.training.stack import make_stack, seed_episodes
from tests.agents.test_training import Quiet

ROOT = Path(__file__).resolve().parents[2]
PPO = TrainConfig(
    "tiny", "ppo", "hold", 512, num_envs=8, disturbances=("calm", "noisy"),
    ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1),
)  # fmt: skip
SAC = replace(
    PPO, algorithm="sac", sac=Sac(2000, batch_size=32, gradient_steps=1, learning_starts=50)
)


class Trap:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def learnt(config: TrainConfig):
    """A learner that has learnt for some steps, and its fish."""
    stack = make_stack(config)
    model = make_model(config, stack)
    seed_episodes(stack, config)
    model.learn(320)
    return model, stack


def equal(one, other) -> bool:
    """Whether two trees of plain values are the same to the bit."""
    if isinstance(one, dict):
        return set(one) == set(other) and all(equal(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(equal, one, other))
    if isinstance(one, (np.ndarray, np.generic)):
        one, other = np.asarray(one), np.asarray(other)
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    return one == other


@pytest.mark.parametrize("config", [PPO, SAC], ids=["ppo", "sac"])
def test_everything_is_put_back(config, tmp_path):
    """Weights, optimisers, counters, replay buffer, generators, normalisation and fish."""
    model, stack = learnt(config)
    before = {"learner": learner_state(model), "stack": stack.state()}
    write_plain(before, tmp_path / "before")
    save_checkpoint(tmp_path / CHECKPOINT, config, learner_state(model), stack, Progress(320))
    random.seed(9), torch.manual_seed(9), np.random.seed(9)  # noqa: NPY002
    other = make_stack(config)
    back = make_model(config, other)
    progress = load_checkpoint(
        tmp_path / CHECKPOINT, config, other, lambda state: restore_learner(back, state)
    )
    assert progress == Progress(320)
    after = {"learner": learner_state(back), "stack": other.state()}
    write_plain(after, tmp_path / "after")
    one, two = (read_plain(tmp_path / name) for name in ("before", "after"))
    for part in ("learner", "stack"):
        assert {key: equal(one[part][key], two[part][key]) for key in one[part]} == dict.fromkeys(
            one[part], True
        )
    moments = [
        s["exp_avg"] for o in one["learner"]["optimisers"].values() for s in o["state"].values()
    ]
    assert moments
    assert all(np.abs(moment).max() > 0 for moment in moments)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("trained")
    train(PPO, folder, Quiet())
    return folder / CHECKPOINT


def test_a_checkpoint_holds_arrays_and_json_alone(checkpoint):
    with zipfile.ZipFile(checkpoint) as archive:
        for name in archive.namelist():
            assert name.endswith(".npy")
            array = np.load(io.BytesIO(archive.read(name)), allow_pickle=False)
            assert not array.dtype.hasobject
    assert json.loads(str(np.load(checkpoint, allow_pickle=False)["tree"]))["format"] == FORMAT


def forged(checkpoint: Path, **members: bytes) -> None:
    """Replaces members of an archive, or adds them."""
    with zipfile.ZipFile(checkpoint) as archive:
        kept = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(checkpoint, "w") as archive:
        for name, content in (kept | members).items():
            archive.writestr(name, content)


def object_array(trap: Trap) -> bytes:
    """A member of an archive that NumPy reads by unpickling it."""
    buffer = io.BytesIO()
    np.save(buffer, np.array([trap], dtype=object), allow_pickle=True)
    return buffer.getvalue()


def whole_pickle(file: Path, trap: Trap) -> None:
    file.write_bytes(pickle.dumps(trap))


def torch_file(file: Path, trap: Trap) -> None:
    torch.save({"learner": trap}, file)


def former_format(file: Path, trap: Trap) -> None:
    """As checkpoints were before: with a pickle, and a learner of Stable-Baselines3."""
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("format", "robofish-checkpoint-1")
        archive.writestr("config.yaml", "{}")
        archive.writestr("learner.zip", b"")
        archive.writestr("state.pkl", pickle.dumps(trap))


FORGERIES = {
    "a pickle": whole_pickle,
    "a file of PyTorch": torch_file,
    "the former format": former_format,
    "objects for an array": lambda file, trap: forged(file, **{"array_3.npy": object_array(trap)}),
    "objects for the text": lambda file, trap: forged(file, **{"tree.npy": object_array(trap)}),
    "a pickle beside": lambda file, trap: forged(
        file, **{"state.pkl": pickle.dumps(trap), "data.pkl": pickle.dumps(trap)}
    ),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_a_forged_checkpoint_runs_no_code(forgery, checkpoint, tmp_path):
    mark, file = tmp_path / "mark", tmp_path / CHECKPOINT
    file.write_bytes(checkpoint.read_bytes())
    FORGERIES[forgery](file, Trap(mark))
    content = file.read_bytes()
    with pytest.raises(ConfigError, match=f"{CHECKPOINT}: .*move it away"):
        train(PPO, tmp_path, Quiet(), resume=True)
    assert not mark.exists()
    assert file.read_bytes() == content


def test_the_traps_are_traps(tmp_path):
    """They do run where pickles are read."""
    pickle.loads(pickle.dumps(Trap(tmp_path / "one")))
    assert (tmp_path / "one").exists()
    np.load(io.BytesIO(object_array(Trap(tmp_path / "two"))), allow_pickle=True)
    assert (tmp_path / "two").exists()


def test_the_former_format_is_named(tmp_path):
    former_format(tmp_path / CHECKPOINT, Trap(tmp_path / "mark"))
    with pytest.raises(ConfigError, match="an earlier version in a form that could run code"):
        train(PPO, tmp_path, Quiet(), resume=True)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_truncated_checkpoint_is_refused(share, checkpoint, tmp_path):
    content = checkpoint.read_bytes()
    (tmp_path / CHECKPOINT).write_bytes(content[: int(share * len(content))])
    with pytest.raises(ConfigError, match=r"checkpoint\.zip: not a readable checkpoint"):
        train(PPO, tmp_path, Quiet(), resume=True)


def test_arrays_of_another_shape_are_refused(checkpoint, tmp_path):
    tree = read_plain(checkpoint)
    tree["stack"]["envs"][0]["batch"]["arrays"]["_data"] = np.zeros((3, 3))
    write_plain(tree, tmp_path / CHECKPOINT)
    with pytest.raises(ConfigError, match="not a readable checkpoint"):
        train(PPO, tmp_path, Quiet(), resume=True)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("steps", None), ("steps", "x"), ("steps", -1), ("steps", float("nan")), ("steps", 1e300),
        ("cpu_s", "x"), ("wall_s", float("inf")), ("evaluations", "x"), ("evaluations", [1]),
        ("evaluations", [{}]), ("evaluations", [{"steps": 1, "success_rate": "x"}]),
    ],
)  # fmt: skip
def test_a_progress_that_cannot_be_is_refused(key, value, checkpoint, tmp_path):
    tree = read_plain(checkpoint)
    tree["progress"][key] = value
    file = tmp_path / "forged.zip"
    write_plain(tree, file)
    with pytest.raises(ConfigError, match="not a readable checkpoint") as caught:
        load_checkpoint(file, PPO, make_stack(PPO), lambda learner: None)
    assert str(caught.value).isprintable()


def test_the_reason_of_a_wrong_network_is_one_line(checkpoint, tmp_path):
    tree = read_plain(checkpoint)
    tree["learner"]["weights"] = {"x": np.zeros(3)}
    file = tmp_path / "forged.zip"
    write_plain(tree, file)
    stack = make_stack(PPO)
    model = make_model(PPO, stack)
    with pytest.raises(ConfigError, match="not a readable checkpoint") as caught:
        load_checkpoint(file, PPO, stack, lambda state: restore_learner(model, state))
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("checksum", [None, "", "0" * 64])
def test_a_checkpoint_that_was_changed_is_refused(checksum, checkpoint, tmp_path):
    """A single number of it; also with the checksum left out, as in the format before."""
    members = dict(np.load(checkpoint, allow_pickle=False))
    if checksum is None:
        members.pop("digest")
    elif checksum:
        members["digest"] = np.array(checksum)
    else:
        name = next(name for name, value in members.items() if value.dtype == np.float32)
        members[name] = members[name] + np.float32(1e-3)
    with (tmp_path / CHECKPOINT).open("wb") as stream:
        np.savez(stream, **members)
    with pytest.raises(ConfigError, match=r"checkpoint\.zip: not a readable.* checksum") as caught:
        train(PPO, tmp_path, Quiet(), resume=True)
    assert str(caught.value).isprintable()


FORGED_MOMENTS = {
    "none": lambda s: s["0"].update(exp_avg=None),
    "text": lambda s: s["0"].update(exp_avg="x"),
    "shape": lambda s: s["0"].update(exp_avg=np.zeros((1, 1), np.float32)),
    "kind": lambda s: s["0"].update(exp_avg=s["0"]["exp_avg"].astype(np.int64)),
    "double": lambda s: s["0"].update(exp_avg=s["0"]["exp_avg"].astype(float)),
    "nan": lambda s: s["0"].update(exp_avg=np.full_like(s["0"]["exp_avg"], np.nan)),
    "negative": lambda s: s["0"].update(exp_avg_sq=s["0"]["exp_avg_sq"] - 1),
    "step": lambda s: s["0"].update(step=np.zeros(3, np.float32)),
    "step of text": lambda s: s["0"].update(step="x"),
    "left out": lambda s: s["0"].pop("exp_avg_sq"),
    "another": lambda s: s["0"].update(more=np.zeros(1)),
    "place": lambda s: s.update({"99": s["0"]}),
    "place below": lambda s: s.update({"-1": s["0"]}),
}


@pytest.mark.parametrize("forgery", FORGED_MOMENTS)
def test_moments_that_cannot_be_are_refused(forgery, checkpoint, tmp_path):
    """Their checksum is right; they ended in a traceback when the training went on."""
    tree = read_plain(checkpoint)
    FORGED_MOMENTS[forgery](tree["learner"]["optimisers"]["policy"]["state"])
    refused(tree, tmp_path / CHECKPOINT)


@pytest.mark.parametrize("rate", [None, "x", float("nan"), -1.0, True])
def test_step_sizes_that_cannot_be_are_refused(rate, checkpoint, tmp_path):
    tree = read_plain(checkpoint)
    tree["learner"]["optimisers"]["policy"]["rates"] = [rate]
    refused(tree, tmp_path / CHECKPOINT)


def test_weights_that_are_not_finite_are_refused(checkpoint, tmp_path):
    tree = read_plain(checkpoint)
    weights = tree["learner"]["weights"]
    weights |= {name: np.full_like(value, np.nan) for name, value in weights.items()}
    refused(tree, tmp_path / CHECKPOINT)


def refused(tree, file: Path) -> None:
    """A training that goes on from a tree ends in one line; it has steps left to learn."""
    tree["progress"]["steps"] = 128
    write_plain(tree, file)
    with pytest.raises(ConfigError, match=rf"{file.name}: not a readable checkpoint") as caught:
        train(PPO, file.parent, Quiet(), resume=True)
    assert str(caught.value).isprintable()


FORGED_STATES = {
    "steps of text": ("learner.counts.num_timesteps", "x"),
    "half an update": ("learner.counts._n_updates", 0.5),
    "no observations": ("learner.latest._last_obs", None),
    "observations of text": ("learner.latest._last_obs", "x"),
    "observations of another width": ("learner.latest._last_obs", np.zeros((1, 1))),
    "observations that are not numbers": ("learner.latest._last_obs", np.nan),
    "an episode of text": ("learner.episodes.ep_info_buffer", "x"),
    "a success that is a list": ("learner.episodes.ep_success_buffer", [[1]]),
    "no time": ("stack.cpu_s", None),
    "returns of another width": ("stack.monitor.0", np.zeros((1, 1))),
    "means of text": ("stack.means.0.0", "x"),
    "means that are not numbers": ("stack.means.0.0", np.nan),
    "no returns": ("stack.returns", None),
    "a place of text": ("stack.envs.0.batch.places.0", "x"),
    "a place before the queue": ("stack.envs.0.batch.places.0", -1),
    "a place behind the ring": ("stack.envs.0.batch.places.1", 10**9),
    "noise from before its beginning": ("stack.envs.0.batch.arrays._noise_used", -1),
    "a history of another kind": ("stack.envs.0.batch.history", "x"),
    "fish that are nowhere": ("stack.envs.0.batch.arrays._data", None),
}


@pytest.mark.parametrize("name", FORGED_STATES)
def test_a_state_of_another_form_is_refused(name, checkpoint, tmp_path):
    """Its checksum is right; each of them ended in a traceback when the training went on."""
    place, value = FORGED_STATES[name]
    tree = read_plain(checkpoint)
    *above, last = [int(key) if key.isdecimal() else key for key in place.split(".")]
    held = tree
    for key in above:
        held = held[key]
    whole = isinstance(held[last], np.ndarray) and isinstance(value, int | float)
    held[last] = np.full_like(held[last], value) if whole else value
    refused(tree, tmp_path / CHECKPOINT)


@pytest.mark.parametrize("value", [np.array([{}], object), object(), {1: 2}, {"a": [Trap]}])
def test_what_is_not_plain_is_not_written(value, tmp_path):
    with pytest.raises(TypeError, match=r"tree.*not plain"):
        write_plain({"a": value}, tmp_path / "file")
    assert not (tmp_path / "file").exists()


def unpicklers(source: str) -> list[str]:
    """Names in a source that unpickle what they are given."""
    names = {"pickle", "cloudpickle", "joblib", "dill", "shelve"}
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [alias.name for alias in node.names]
            found += [module for module in modules if module.split(".")[0] in names]
        if isinstance(node, ast.Attribute) and ast.unparse(node) in ("torch.load", "PPO.load"):
            found.append(ast.unparse(node))
        if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
            found += ["allow_pickle"] * (ast.unparse(node.value) != "False")
    return found


@pytest.mark.parametrize("folder", ["agents", "fish_env"])
def test_no_module_unpickles(folder):
    for file in sorted((ROOT / folder).rglob("*.py")):
        assert unpicklers(file.read_text(encoding="utf-8")) == [], file


def test_the_check_for_unpickling_notices_each_kind():
    for line in ("import pickle", "from joblib import load", "torch.load(f)", "PPO.load(f)"):
        assert unpicklers(line), line
    assert unpicklers("np.load(f, allow_pickle=True)")
    assert not unpicklers("import copyreg\nnp.load(f, allow_pickle=False)")
