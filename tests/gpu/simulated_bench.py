"""The bench of the GPU runs from end to end on simulated CUDA.

Run by test_simulated.py in a process with ``NUMBA_ENABLE_CUDASIM=1``.
"""

import json

import pytest

from robofish_agents.training import actor_critic, tensor_ppo
from scripts.bench import gpu, gpu_contenders

SHORT = ["--counts", "2", "--rounds", "1", "--seconds", "0.01"]


@pytest.fixture
def written(monkeypatch, tmp_path):
    monkeypatch.setattr(gpu, "RESULTS", tmp_path)
    recipe = actor_critic.Recipe(iterations=1, steps=2, epochs=1, minibatches=1)
    monkeypatch.setattr(actor_critic, "HOLD", recipe)
    monkeypatch.setattr(actor_critic, "HOLD_FISH", 2)
    monkeypatch.setattr(gpu, "SEEDS", range(1))
    monkeypatch.setattr(tensor_ppo, "success_rate", lambda env, policy, seed: 0.5)
    monkeypatch.setattr(gpu_contenders, "mjx_swimmer", missing)
    gpu.main(SHORT)
    (file,) = tmp_path.glob("gpu-*.json")
    return json.loads(file.read_text()), file.with_suffix(".md").read_text()


WHY = "RuntimeError: out of memory"


def missing(envs):
    raise RuntimeError("out of memory")


def test_it_writes_what_it_measured(written):
    content, page = written
    assert content["gpu"] == "numba's simulator of CUDA"
    rows = {row["name"]: row for row in content["speed"]}
    on_device = rows["RoboticFish3D-v0 on the GPU, float32, 2"]
    assert on_device["physics_steps_per_s"] == 10 * on_device["control_steps_per_s"] > 0
    assert rows["RoboticFish3D-v0, gym.make_vec 2"]["control_steps_per_s"] > 0
    assert content["missing"] == [{"name": "MJX", "reason": WHY}]
    single, double = content["accuracy"][1], content["accuracy"][0]
    assert double["state after 3 steps"] < 1e-10 < single["state after 3 steps"] < 1e-4
    assert content["training"][0]["control_steps"] == 4
    assert "0 of 1 seeds reach 95%" in page
    assert "Missing: MJX" in page


def test_nothing_is_written_on_a_dry_run(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(gpu, "RESULTS", tmp_path)
    gpu.main([*SHORT, "--only", "device 2", "--no-train", "--dry"])
    assert not list(tmp_path.iterdir())
    assert "float32, 2 | 2 |" in capsys.readouterr().out
