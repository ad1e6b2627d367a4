"""Exported policies act as the policy file does, and their contracts say what is true."""

import hashlib
import json
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from fish_env.envs.config import load_env_config
from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.tasks import TASKS
from fish_env.errors import ConfigError
from robofish_agents.deployment import contract_path, export_c, export_onnx, with_int8_weights
from robofish_agents.policies import (
    HistorySpec,
    Network,
    PolicyFile,
    read_policy,
    shipped,
    write_policy,
)
from scripts.exported import CompiledPolicy, OnnxPolicy, compiler, differences
from tests.command_line import run

SIZE = len(OBSERVATION)
TOLERANCE = 1e-6
needs_compiler = pytest.mark.skipif(compiler() is None, reason="there is no C compiler")


def drawn(history: HistorySpec, activation: str = "tanh", output: str = "clip") -> PolicyFile:
    """A policy with random numbers; some observations hardly vary, as in the shipped ones."""
    rng = np.random.default_rng(history.frames)
    widths = [history.width(SIZE), 24, 16, 5]
    layers = list(zip(widths[1:], widths, strict=False))
    scale = 10.0 ** rng.uniform(-4.0, 0.5, widths[0])
    network = Network(
        rng.normal(size=widths[0]), scale, 10.0,
        tuple((rng.normal(size=shape) / np.sqrt(shape[1])).astype(np.float32) for shape in layers),
        tuple(rng.normal(size=shape[0]).astype(np.float32) / 3 for shape in layers),
        activation, output,
    )  # fmt: skip
    return PolicyFile(network, history, "hold", ENV_ID, {})


KINDS = {
    "shipped for hold": read_policy(shipped("hold")[0]),
    "shipped for track": read_policy(shipped("track")[1]),
    "shipped for station": read_policy(shipped("station")[0]),
    "the present alone": drawn(HistorySpec()),
    "two frames": drawn(HistorySpec(2)),
    "four frames and two filters": drawn(HistorySpec(4, (0.5, 2.0)), "relu", "tanh"),
}


@pytest.mark.parametrize("kind", KINDS)
def test_an_onnx_model_acts_as_the_policy(kind, tmp_path):
    pytest.importorskip("onnx", reason="the extra `export` is not installed")
    pytest.importorskip("onnxruntime", reason="the extra `dev` is not installed")
    policy = KINDS[kind]
    export_onnx(policy, tmp_path / "policy.onnx")
    exported = {"onnx": OnnxPolicy(tmp_path / "policy.onnx")}
    assert differences(policy, exported, "hold", 60, 40)["onnx"][0] < TOLERANCE


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
def test_a_c_header_acts_as_the_policy(kind, tmp_path):
    policy = KINDS[kind]
    export_c(policy, tmp_path / "plain.h")
    export_c(policy, tmp_path / "small.h", int8=True)
    plain, small = CompiledPolicy(tmp_path / "plain.h"), CompiledPolicy(tmp_path / "small.h")
    assert differences(policy, {"c": plain}, "hold", 60, 40)["c"][0] < TOLERANCE
    rounded = with_int8_weights(policy)
    assert differences(rounded, {"c": small}, "hold", 60, 40)["c"][0] < TOLERANCE
    if "shipped" in kind:
        assert small.flash_bytes() < 0.4 * plain.flash_bytes()
        assert differences(policy, {"c": small}, "hold", 60, 40)["c"][1] < 0.02


@needs_compiler
def test_a_c_header_can_compute_in_single_precision(tmp_path):
    export_c(KINDS["shipped for track"], tmp_path / "policy.h")
    exported = {"c": CompiledPolicy(tmp_path / "policy.h", "-DPOLICY_SINGLE")}
    largest, _ = differences(KINDS["shipped for track"], exported, "track", 60, 40)["c"]
    assert 1e-9 < largest < 2e-5


BREAKS = {
    "a weight that is forgotten": (r"(_weight_1\[\d+\] = \{\n  )\S+", r"\1 0.0f,"),
    "the remainder of the means": (r"near_mean - \w+_mean_rest\[i\]", "near_mean"),
    "the filters": (r"(\w+_shares\[j\]) \*", r"1.01f * \1 *"),
    "the clipping": (r"\(\w+_real\)10\)", "(policy_real)9)"),
    "the order of actions": (r"action\[i\] = \(float\)", "action[4 - i] = (float)"),
    "the first step": (r"past\[33 \* j\] = now", "past[33 * j] = 0"),
}


@needs_compiler
@pytest.mark.parametrize("broken", BREAKS)
def test_a_broken_header_is_noticed(broken, tmp_path):
    """The comparison above is worth something: each of these small mistakes fails it."""
    policy, file = KINDS["shipped for track"], tmp_path / "policy.h"
    export_c(policy, file)
    pattern, replacement = BREAKS[broken]
    text, count = re.subn(pattern, replacement, file.read_text())
    assert count == 1
    file.write_text(text)
    exported = {"c": CompiledPolicy(file)}
    assert differences(policy, exported, "track", 60, 40)["c"][0] > TOLERANCE


@pytest.mark.parametrize("broken", ["mean", "weight"])
def test_an_onnx_model_of_another_policy_is_noticed(broken, tmp_path):
    pytest.importorskip("onnx", reason="the extra `export` is not installed")
    pytest.importorskip("onnxruntime", reason="the extra `dev` is not installed")
    policy = KINDS["shipped for hold"]
    network, weights = policy.network, policy.network.weights
    other = {
        "mean": {"mean": network.mean + 1e-5},
        "weight": {"weights": (weights[0] * np.float32(1.0001), *weights[1:])},
    }[broken]
    export_onnx(replace(policy, network=replace(network, **other)), tmp_path / "other.onnx")
    exported = {"onnx": OnnxPolicy(tmp_path / "other.onnx")}
    assert differences(policy, exported, "hold", 60, 40)["onnx"][0] > TOLERANCE


@needs_compiler
def test_a_header_refuses_what_is_not_finite_and_forgets_nothing(tmp_path):
    policy = KINDS["two frames"]
    export_c(policy, tmp_path / "policy.h")
    one, other = (CompiledPolicy(tmp_path / "policy.h") for _ in range(2))
    one.reset(1)
    other.reset(1)
    rng = np.random.default_rng(0)
    for wrong in (np.nan, np.inf, -np.inf):
        seen = rng.normal(size=(1, SIZE)).astype(np.float32)
        np.testing.assert_array_equal(one.act(seen), other.act(seen))
        assert one.good == 1
        seen[0, 7] = wrong
        assert np.isnan(one.act(seen)).all()
        assert one.good == 0


@needs_compiler
def test_targets_are_those_of_the_environment(tmp_path):
    export_c(KINDS["shipped for hold"], tmp_path / "policy.h")
    compiled, config = CompiledPolicy(tmp_path / "policy.h"), load_env_config()
    for action in (np.full(5, -1.0), np.full(5, 1.0), np.array([0.3, -0.2, 0.9, 2.0, -3.0])):
        wanted = config.low + (np.clip(action, -1, 1) + 1) / 2 * (config.high - config.low)
        np.testing.assert_allclose(compiled.targets(action), wanted, rtol=1e-6, atol=1e-8)


@needs_compiler
def test_two_headers_fit_into_one_program_of_c_or_cpp(tmp_path):
    for name, policy in (("hold-1.h", "shipped for hold"), ("track.h", "shipped for track")):
        export_c(KINDS[policy], tmp_path / name)
    source = '#include "hold-1.h"\n#include "track.h"\nint main(void) {\n'
    source += "hold_1_memory a; track_memory b; hold_1_reset(&a); track_reset(&b);\n"
    source += "{ float o[HOLD_1_OBSERVATIONS] = {0}, u[TRACK_ACTIONS], t[5];\n"
    source += "track_targets(u, t); hold_1_targets(u, t);\n"
    source += "return hold_1_act(&a, o, u) + track_act(&b, o, u) - 2; } }\n"
    (tmp_path / "main.c").write_text(source.replace("u[TRACK_ACTIONS]", "u[TRACK_ACTIONS] = {0}"))
    for language in (["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"], ["-x", "c++"]):
        program = tmp_path / "program"
        command = [compiler(), *language, str(tmp_path / "main.c"), "-o", str(program), "-lm"]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if "cc1plus" in done.stderr:
            pytest.skip("the compiler knows no C++")
        assert done.returncode == 0, done.stderr
        assert subprocess.run([str(program)], check=False).returncode == 0


def test_a_contract_says_what_the_environment_does(tmp_path):
    policy = KINDS["shipped for track"]
    file, path = export_c(policy, tmp_path / "policy.h")
    contract = json.loads(path.read_text())
    assert path == contract_path(file)
    assert contract["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    assert (contract["task"], contract["environment"]) == ("track", ENV_ID)
    assert contract["rate_hz"] == RoboticFish3DEnv().metadata["render_fps"] == 10.0
    assert contract["history"]["low_pass_s"] == list(policy.history.low_pass_s)
    entries = contract["observation"]["entries"]
    assert [entry["is"] for entry in entries] == [text for text, _ in OBSERVATION]
    names = [entry["name"] for entry in entries]
    assert len(set(names)) == SIZE
    assert all(name.isidentifier() for name in names)


def test_the_scales_of_a_contract_give_the_observation(tmp_path):
    """What the environment shows of its state, scaled as the contract says, is what it sees."""
    _, path = export_c(KINDS["shipped for hold"], tmp_path / "policy.h")
    contract = json.loads(path.read_text())
    env = RoboticFish3DEnv()
    seen, _ = env.reset(seed=1)
    for _ in range(30):
        seen, _, _, _, info = env.step(env.action_space.sample())
    known = {
        "depth_error": info["depth_error"],
        "depth": info["depth"],
        "speed_error": info["speed_error"],
        "goal_speed": info["goal_speed"],
        "yaw_rate": env.state["r"],
        "surge_speed_over_ground": env.state["u"],
    }
    for name, position in zip(("offset", "amplitude", "frequency"), env.actuators[:3], strict=True):
        known[f"tail_{name}_now"] = position
    known |= {"block_displacement_now": env.actuators[3], "block_angle_now": env.actuators[4]}
    entries = {entry["name"]: entry for entry in contract["observation"]["entries"]}
    for name, value in known.items():
        entry = entries[name]
        scaled = (value - entry["subtract"]) / entry["divide_by"]
        assert scaled == pytest.approx(seen[entry["index"]], abs=1e-5), name
    config = env.options.config
    actions = contract["action"]["entries"]
    np.testing.assert_array_equal([a["low"] for a in actions], config.low)
    np.testing.assert_array_equal([a["high"] for a in actions], config.high)
    np.testing.assert_array_equal([a["most_per_s"] for a in actions], config.slew)


def test_settings_of_the_training_reach_the_contract(tmp_path):
    tank = {"config": {"tank": {"depth": 2.0}}, "control_hz": 20.0}
    history = HistorySpec(period_s=0.05)
    policy = replace(drawn(history), card={"configuration": {"environment": tank}})
    _, path = export_c(policy, tmp_path / "policy.h")
    contract = json.loads(path.read_text())
    assert (contract["rate_hz"], contract["limits"]["deepest_m"]) == (20.0, 1.95)
    with pytest.raises(ConfigError, match=r"every 0\.05 s.*--config"):
        export_c(replace(policy, card={}), tmp_path / "policy.h")
    named = {"configuration": {"environment": {"config": "pool.yaml"}}}
    with pytest.raises(ConfigError, match="--config"):
        export_c(replace(policy, card=named), tmp_path / "policy.h")
    export_c(replace(policy, card=named), tmp_path / "policy.h", {"rates": {"control": 20.0}})


def test_a_model_carries_its_contract(tmp_path):
    pytest.importorskip("onnx", reason="the extra `export` is not installed")
    pytest.importorskip("onnxruntime", reason="the extra `dev` is not installed")
    file, path = export_onnx(KINDS["shipped for hold"], tmp_path / "policy.onnx")
    inside = OnnxPolicy(file).session.get_modelmeta().custom_metadata_map["contract"]
    beside = json.loads(path.read_text())
    assert json.loads(inside).items() <= beside.items()
    again, _ = export_onnx(KINDS["shipped for hold"], tmp_path / "again.onnx")
    assert again.read_bytes() == file.read_bytes()


@pytest.mark.parametrize("name", TASKS)
def test_the_command_writes_and_names_its_files(name, tmp_path, capsys):
    header = tmp_path / f"{name}.h"
    status, out, _ = run(capsys, "export", name, "--c", str(header), "--json", "-")
    assert status == 0
    assert [entry["file"] for entry in json.loads(out)["files"]] == [
        str(header),
        str(contract_path(header)),
    ]
    assert f"{name}_act(" in header.read_text()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["hold"], "--onnx FILE or --c FILE"),
        (["hold", "--int8", "--onnx", "x.onnx"], "--int8 is for the C header"),
        (["hold", "--c", "-"], "give it a name"),
        (["nothing.npz", "--c", "x.h"], "nothing.npz: no such policy file"),
        (["holt", "--c", "x.h"], "a shipped policy: hold, track, path, station"),
        (["hold", "--c", "x.h", "--onnx", "x.h"], "two outputs"),
    ],
)
def test_the_command_refuses_what_cannot_be(arguments, says, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, _, err = run(capsys, "export", *arguments)
    assert status == 2
    assert says in err
    assert list(tmp_path.iterdir()) == []


def test_the_command_does_not_replace_the_policy(tmp_path, capsys):
    file = tmp_path / "policy.h.json"
    write_policy(KINDS["the present alone"], file)
    before = file.read_bytes()
    status, _, err = run(capsys, "export", str(file), "--c", str(tmp_path / "policy.h"))
    assert status == 2
    assert "is read" in err
    assert file.read_bytes() == before
