"""Files that are nearly right: mutated trees, cells and bytes are read, or refused in one line.

`make fuzz` tries more of them: the variable FUZZ_EXAMPLES sets how many each test draws.
"""

import copy
import io
import json
import os
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fish_env.archives import UNREADABLE, digest
from fish_env.envs.options import env_options
from fish_env.params.io import config_root
from robofish_agents.policies.files import read_policy
from robofish_agents.policies.pretrained import shipped
from robofish_agents.training.plain import read_plain, write_plain
from tests.fixtures.measured_data import DESCRIPTION, RUN, STEADY, TABLE, write_folder
from tests.fuzzing.found_inputs import OPTIONS
from tests.fuzzing.readers import READERS, fault

fuzz = settings(
    max_examples=int(os.environ.get("FUZZ_EXAMPLES", "10")),
    deadline=None,
    derandomize="FUZZ_EXAMPLES" not in os.environ,
    suppress_health_check=list(HealthCheck),
)
CASE = {
    "fish": "zheng-2021-a",
    "duration_s": 1.0,
    "schedule": [{"t": 0.0, "tail_amplitude": 0.3}, {"t": 0.5, "tail_frequency": 2.0}],
    "initial": {"position_inertial": [0, 0, 1], "tail_phase": 0.0},
    "effects": {"servo_lag": {"time_constant": 0.05}},
}
MAPPING = {
    "format": "robofish-import/1", "name": "a", "fish": "zheng-2021-a", "frame": "ned",
    "sources": {"log": {"files": "*.csv", "time": {"column": "t", "unit": "s", "offset": 0.5}}},
    "channels": {"x": {"column": "x", "unit": "m", "scale": 2.0, "sign": -1}},
    "commands": {"tail_offset": {"column": "o", "unit": "rad", "between": "hold"}},
    "constant_commands": {"tail_amplitude": 0.3, "tail_frequency": 1},
    "runs": [{"id": "r1", "files": ["a.csv"], "start": "rest"}],
}  # fmt: skip
RESULTS = {"results": [{"agent": "pid", "metrics": {"depth": {"mean": 1.0}}}]}


def shipped_tree(name):
    return yaml.safe_load((config_root() / name).read_text(encoding="utf-8"))


TREES = {
    "fish": shipped_tree("fish/zheng-2021-a.yaml"),
    "files of a fish": {"base": "zheng-2021-a", "name": "x", "effects": {"servo_lag": {}}},
    "dataset": DESCRIPTION,
    "environment": shipped_tree("env/robotic-fish-3d.yaml"),
    "suite": shipped_tree("benchmarks/noisy.yaml"),
    "training": shipped_tree("train/ppo-hold.yaml"),
    "case": CASE,
    "results": RESULTS,
    "mapping": MAPPING,
}

numbers = (
    st.integers() | st.floats() | st.just(10**400) | st.sampled_from([0, -1, 1e-12, 1e12, 1e300])
)
words = st.text(max_size=8) | st.sampled_from(
    ["~nouser", "/dev/zero", "a\0b", "[/red]", "\x1b[31m", "$\\frac{", "12:30", "1_000", "NaN"]
)
leaves = st.none() | st.booleans() | numbers | words
trees = st.recursive(
    leaves,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=6,
)


def paths_in(tree, path=()):
    """Paths of everything in a tree."""
    items = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    for key, value in items:
        yield (*path, key)
        yield from paths_in(value, (*path, key))


@st.composite
def mutated(draw, tree):
    """A tree with one to three places replaced, removed or renamed."""
    result = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        *above, key = draw(st.sampled_from([*paths_in(result)] or [("x",)]))
        place = result
        for step in above:
            place = place[step]
        how = draw(st.sampled_from(["replace", "replace", "remove", "rename"]))
        if how == "replace" or not isinstance(place, dict):
            place[key] = draw(trees)
        else:
            value = place.pop(key, None)
            if how == "rename":
                place[draw(words)] = value
    return result


def dumped(tree, suffix):
    if suffix == ".json":
        return json.dumps(tree).encode()
    return yaml.safe_dump(tree, allow_unicode=True).encode("utf-8", "surrogatepass")


@pytest.fixture(autouse=True)
def _quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("reader", TREES)
@fuzz
@given(data=st.data())
def test_mutated_trees(reader, tmp_path_factory, data):
    read, suffix = READERS[reader]
    file = tmp_path_factory.getbasetemp() / f"mutated{suffix}"
    file.with_name("r01.csv").write_text(RUN)
    file.write_bytes(dumped(data.draw(mutated(TREES[reader])), suffix))
    fault(read, file)


@pytest.mark.parametrize("kind", ["run", "steady"])
@fuzz
@given(data=st.data())
def test_mutated_tables(kind, tmp_path_factory, data):
    text, description = (RUN, DESCRIPTION) if kind == "run" else (TABLE, STEADY)
    lines = [line.split(",") for line in text.splitlines()]
    for _ in range(data.draw(st.integers(1, 4))):
        row = data.draw(st.integers(0, len(lines) - 1))
        column = data.draw(st.integers(0, len(lines[row]) - 1))
        lines[row][column] = str(data.draw(leaves.filter(lambda leaf: leaf != 10**400)))
    table = "\n".join(map(",".join, lines))
    folder = tmp_path_factory.getbasetemp() / f"tables-{kind}"
    content = table.encode("utf-8", "replace").decode()
    fault(READERS["dataset"][0], write_folder(folder, description, r01=content, table=content))
    fault(READERS["replay"][0], folder / "table.csv")
    fault(READERS["waypoints"][0], folder / "table.csv")


@pytest.mark.parametrize("reader", READERS)
@fuzz
@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_bytes(reader, tmp_path_factory, content):
    read, suffix = READERS[reader]
    file = tmp_path_factory.getbasetemp() / f"bytes{suffix}"
    file.write_bytes(content)
    fault(read, file)


@pytest.mark.parametrize("option", OPTIONS)
@fuzz
@given(value=trees)
def test_any_value_of_an_option(option, value):
    fault(env_options, **{option: value})


@fuzz
@given(data=st.data())
def test_damaged_policies(tmp_path_factory, data):
    content = bytearray(shipped("hold")[0].read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file = tmp_path_factory.getbasetemp() / "damaged.npz"
    file.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    fault(read_policy, file)


FORGED = ["limit", "frames", "layers", "low_pass_s", "period_s", "card", "task", "observation"]


@fuzz
@given(key=st.sampled_from(FORGED), value=trees)
def test_forged_policies(tmp_path_factory, key, value):
    """With a right checksum, any description is taken or refused, and a NaN limit is refused."""
    with np.load(shipped("hold")[0]) as members:
        arrays = {name: members[name] for name in members.files}
    about = json.loads(str(arrays["about"])) | {key: value}
    file = forged(tmp_path_factory.getbasetemp() / "forged.npz", about, arrays)
    message = fault(read_policy, file)
    if key == "limit" and not (isinstance(value, (int, float)) and 0 < value < 1e308):
        assert message


def forged(file: Path, about: dict, arrays: dict) -> Path:
    document = json.dumps(about)
    numbers = {name: value for name, value in arrays.items() if name not in ("about", "digest")}
    checksum = np.array(digest(document, numbers))
    np.savez(file, about=np.array(document), digest=checksum, **numbers)
    return file


@fuzz
@given(data=st.data())
def test_damaged_checkpoints(tmp_path_factory, data):
    """Reading plain values raises what `load_checkpoint` words, and nothing else."""
    file = tmp_path_factory.getbasetemp() / "checkpoint.zip"
    write_plain({"format": "x", "weights": np.arange(50.0), "deep": {"a": [1, 2]}}, file)
    content = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        read_plain(file)
    except (*UNREADABLE, AttributeError, IndexError):
        pass


def test_an_array_that_promises_petabytes_is_refused(tmp_path):
    header = io.BytesIO()
    promised = {"descr": "<f8", "fortran_order": False, "shape": (10**15,)}
    np.lib.format.write_array_header_1_0(header, promised)
    file = tmp_path / "huge.npz"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("about.npy", header.getvalue())
    assert "shape" in str(fault(read_policy, file))


def test_the_check_notices_a_traceback_and_a_long_message():
    with pytest.raises(ZeroDivisionError):
        fault(lambda: 1 / 0)
    from fish_env.errors import ConfigError

    def wordy():
        raise ConfigError("x" * 5000)

    with pytest.raises(AssertionError):
        fault(wordy)
