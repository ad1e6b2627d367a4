"""What is written reads back equal to the last bit, and what could not is refused."""

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fish_env.data import (
    CHANNELS,
    COMMANDS,
    OBSERVATIONS,
    CommandSteps,
    Dataset,
    Run,
    SteadyDataset,
    load_dataset,
    write_dataset,
)
from fish_env.data.plausibility import WINDING_START
from fish_env.errors import DatasetError

IDS = st.text("abcXYZ019_-+ é", min_size=1, max_size=8).filter(lambda text: text == text.strip())
# Within what a yaw can be, without jumps that would look like degrees.
YAW_LIMIT = 0.5
# Within half a second, slower than would look like millimetres.
WAY_LIMIT = 1.2


def values(quantity, rows, missing=True, name=""):
    limit = YAW_LIMIT if name == "yaw" or quantity.dimension == "rate" else 1e6
    limit = WAY_LIMIT if quantity.dimension == "length" else limit
    lower, upper = max(quantity.lower, -limit), min(quantity.upper, limit)
    numbers = st.floats(lower, upper)
    elements = st.one_of(numbers, st.just(math.nan)) if missing else numbers
    return arrays(np.float64, rows, elements=elements).map(with_a_sample)


def with_a_sample(column):
    return np.zeros(column.shape) if np.isnan(column).all() else column


@st.composite
def command_rows(draw, rows):
    columns = [draw(values(quantity, rows, missing=False)) for quantity in COMMANDS.values()]
    return np.column_stack(columns)


@st.composite
def runs(draw, id, names):
    rows = draw(st.integers(2, 6))
    steps = draw(arrays(np.float64, rows, elements=st.floats(1e-3, 1e3)))
    time = np.cumsum(steps)
    channels = {name: draw(values(CHANNELS[name], rows, name=name)) for name in names}
    commands = CommandSteps(time, draw(command_rows(rows)))
    phase = draw(st.one_of(st.none(), st.floats(-math.pi, math.pi)))
    condition = draw(st.one_of(st.none(), IDS))
    start = draw(st.sampled_from(["rest", "unknown"]))
    return Run(id, time, channels, commands, start, phase, condition)


@st.composite
def datasets(draw):
    names = draw(st.sets(st.sampled_from(list(CHANNELS)), min_size=1))
    ids = draw(st.lists(IDS, min_size=1, max_size=3, unique_by=str.casefold))
    noise = {name: draw(st.floats(1e-9, 0.9)) for name in names if draw(st.booleans())}
    members = tuple(draw(runs(id, names)) for id in ids)
    return Dataset("d", "zheng-2021-a", members, noise, {"source": "a: b # c"})


@st.composite
def steady_datasets(draw):
    ids = tuple(draw(st.lists(IDS, min_size=1, max_size=5, unique=True)))
    names = draw(st.sets(st.sampled_from(list(OBSERVATIONS)), min_size=1))
    observations = {name: draw(values(OBSERVATIONS[name], len(ids))) for name in names}
    conditions = tuple(draw(st.one_of(st.none(), IDS)) for _ in ids)
    commands = draw(command_rows(len(ids)))
    return SteadyDataset("s", "zheng-2021-b", ids, conditions, commands, observations)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.one_of(datasets(), steady_datasets()))
def test_round_trip(dataset):
    with tempfile.TemporaryDirectory() as folder:
        assert load_dataset(write_dataset(dataset, Path(folder) / "written")) == dataset


def small_dataset(**changes) -> Dataset:
    commands = CommandSteps(np.zeros(1), np.zeros((1, 5)))
    run = Run("r01", np.arange(3.0), {"x": np.arange(3.0)}, commands, "rest", 0.0)
    return replace(Dataset("d", "zheng-2021-a", (run,)), **changes)


@pytest.mark.parametrize("field", ["x", "time", "commands", "tail_phase", "noise", "fish"])
def test_equality_sees_every_difference(field):
    dataset, run = small_dataset(), small_dataset().runs[0]
    changed = {
        "x": {"runs": (replace(run, channels={"x": np.array([0.0, 1.0, 2.0 + 1e-15])}),)},
        "time": {"runs": (replace(run, time_s=np.array([0.0, 1.0, 2.5])),)},
        "commands": {"runs": (replace(run, commands=CommandSteps([0.0], [[0, 0, 0, 0, 1.0]])),)},
        "tail_phase": {"runs": (replace(run, tail_phase=None),)},
        "noise": {"noise": {"x": 0.1}},
        "fish": {"fish": "zheng-2021-b"},
    }
    assert dataset == small_dataset(notes=("other",))
    assert dataset != small_dataset(**changed[field])
    assert dataset != "d"


def test_a_fish_file_is_written_relative(tmp_path):
    fish = tmp_path / "mine.yaml"
    fish.write_text("base: zheng-2021-a\nname: mine\n")
    dataset = small_dataset(fish=str(fish.resolve()))
    folder = write_dataset(dataset, tmp_path / "written")
    assert "fish: ../mine.yaml" in (folder / "dataset.yaml").read_text()
    assert load_dataset(folder) == dataset


def test_writing_refuses_what_it_would_spoil(tmp_path):
    dataset = small_dataset()
    write_dataset(dataset, tmp_path / "a")
    with pytest.raises(DatasetError, match="already holds"):
        write_dataset(dataset, tmp_path / "a")
    with pytest.raises(DatasetError, match="frame 'nwu'"):
        write_dataset(dataset, tmp_path / "b", frame="nwu")
    for id in ("../r01", "a:b", ".."):
        outside = replace(dataset, runs=(replace(dataset.runs[0], id=id),))
        with pytest.raises(DatasetError, match="file name"):
            write_dataset(outside, tmp_path / "c")


def test_commands_between_samples_become_rows_without_samples(tmp_path):
    steps = CommandSteps(np.array([-1.0, 0.5, 1.0, 9.0]), np.diag([0.1, 0.2, 0.3, 0.4, 0.5])[:4])
    run = Run.from_steps("r", [0.0, 1.0, 2.0], {"x": [1.0, 2.0, 3.0]}, steps, start="unknown")
    np.testing.assert_array_equal(run.time_s, [0.0, 0.5, 1.0, 2.0])
    np.testing.assert_array_equal(run.channels["x"], [1.0, np.nan, 2.0, 3.0])
    np.testing.assert_array_equal(run.commands.times_s, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(run.commands.at(run.time_s), steps.at(run.time_s))
    dataset = small_dataset(runs=(run,))
    assert load_dataset(write_dataset(dataset, tmp_path / "d")) == dataset


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"time_s": [0.0, 2.0, 1.0]}, "increasing"),
        ({"time_s": [0.0]}, "two samples"),
        ({"channels": {}}, "at least one channel"),
        ({"channels": {"heading": np.zeros(3)}}, "unknown name 'heading'"),
        ({"channels": {"x": np.zeros(2)}}, "shape"),
        ({"channels": {"x": np.full(3, np.nan)}}, "no sample"),
        ({"channels": {"x": np.array([0.0, np.inf, 0.0])}}, "infinite"),
        ({"commands": CommandSteps([0.5], np.zeros((1, 5)))}, "begin at the first sample"),
        ({"commands": CommandSteps([0.0, 0.5], np.eye(5)[:2])}, "from_steps"),
    ],
)
def test_impossible_runs(changes, expected):
    with pytest.raises(DatasetError, match=expected):
        replace(small_dataset().runs[0], **changes)


@pytest.mark.parametrize(
    ("times", "rows", "expected"),
    [
        ([], np.zeros((0, 5)), "shape"),
        ([0.0], np.zeros((1, 4)), "shape"),
        ([0.0, 0.0], np.zeros((2, 5)), "increasing"),
        ([0.0], np.full((1, 5), np.nan), "finite"),
    ],
)
def test_impossible_commands(times, rows, expected):
    with pytest.raises(DatasetError, match=expected):
        CommandSteps(times, rows)


def test_impossible_datasets():
    run = small_dataset().runs[0]
    other = replace(run, id="r02", channels={"y": np.zeros(3)})
    for changes, expected in (
        ({"runs": ()}, "at least one run"),
        ({"runs": (run, run)}, "unique"),
        ({"runs": (run, other)}, "same channels"),
        ({"noise": {"y": 0.1}}, "not measured"),
        ({"noise": {"x": 0.0}}, "positive"),
    ):
        with pytest.raises(DatasetError, match=expected):
            small_dataset(**changes)
    with pytest.raises(DatasetError, match="no run 'r9'"):
        small_dataset().run("r9")


def test_yaw_limit_is_within_what_reading_accepts():
    assert YAW_LIMIT < WINDING_START
