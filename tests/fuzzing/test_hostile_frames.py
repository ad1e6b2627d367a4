"""Frames and arguments of any kind are read by `from_frames`, or refused in one line."""

import warnings
from datetime import timedelta
from decimal import Decimal

import numpy as np
import pandas as pd
import pytest

from fish_env.data import from_frames
from tests.fuzzing.readers import fault

ROWS = 50
TIME = np.arange(ROWS) * 0.02
COMMANDS = {"tail_offset": "rad", "tail_amplitude": "rad", "tail_frequency": "Hz"}
CONSTANTS = {"block_displacement": 0.0, "block_angle": 0.0}
DECLARED = {"channels": {"x": "m"}, "commands": COMMANDS, "constant_commands": CONSTANTS}
USUAL = {"fish": "zheng-2021-a", "frame": "ned"}
START = pd.Timestamp("2020") + pd.to_timedelta(TIME, unit="s")


def frame(**columns: object) -> pd.DataFrame:
    usual = {"t": TIME, "x": 0.1 * TIME, "tail_offset": 0.0 * TIME}
    usual |= {"tail_amplitude": 0.3 + 0.0 * TIME, "tail_frequency": 1.0 + 0.0 * TIME}
    return pd.DataFrame(usual | columns)


COLUMNS: dict[str, dict[str, object]] = {
    "complex": {"x": 1j * TIME},
    "objects": {"x": [object()] * ROWS},
    "bytes": {"x": [b"1"] * ROWS},
    "lists": {"x": [[1, 2]] * ROWS},
    "frames": {"x": [pd.DataFrame()] * ROWS},
    "categories": {"x": pd.Categorical(["a", "b"] * (ROWS // 2))},
    "decimals": {"x": [Decimal(1)] * ROWS},
    "large whole numbers": {"x": [10**400] * ROWS},
    "missing": {"x": pd.array([pd.NA] * ROWS, dtype="Float64")},
    "missing and whole": {"x": pd.array([1] * (ROWS - 1) + [None], dtype="Int64")},
    "infinite": {"x": np.inf + TIME},
    "far away": {"x": np.full(ROWS, 1e300)},
    "infinite times": {"t": np.inf + TIME},
    "late times": {"t": 1e300 * TIME},
    "times beyond 64 bits": {"t": np.arange(ROWS, dtype=np.uint64) + np.uint64(2**63)},
    "no times": {"t": [pd.NaT] * ROWS},
    "spans": {"t": [timedelta(seconds=float(time)) for time in TIME]},
    "periods": {"t": pd.period_range("2020", periods=ROWS, freq="s")},
    "a far year": {"t": np.array(["9999-01-01"] * ROWS, "M8[s]")},
    "a zone": {"t": START.tz_localize("Europe/Berlin")},
    "an escape": {"x\x1b[2J": TIME},
}
FRAMES: dict[str, object] = {
    "nothing": None,
    "a list": [1],
    "a series": pd.Series(TIME),
    "no frame": {},
    "a frame of none": {"a": None},
    "frames of frames of none": {"a": {"b": None}},
    "an empty frame": pd.DataFrame(),
    "no rows": frame().iloc[:0],
    "two columns of one name": pd.concat([frame(), frame()], axis=1),
    "two levels of columns": pd.concat({"a": frame()}, axis=1),
    "two levels of rows": frame().set_index(["t", "x"]),
    "a column without a name": frame().rename(columns={"x": None}),
    "two runs of one file name": {"a/b": frame(), "a:b": frame()},
}


@pytest.mark.parametrize("given", [DECLARED, {}], ids=["declared", "guessed"])
@pytest.mark.parametrize("log", [*COLUMNS, *FRAMES])
def test_any_frame_is_read_or_refused(log, given):
    frames = frame(**COLUMNS[log]) if log in COLUMNS else FRAMES[log]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        message = fault(from_frames, frames, **USUAL, **given)
    assert message is None or message.isprintable()
    if log in FRAMES:
        assert message


WRONG = [
    {"fish": 5}, {"fish": "~nouser/x"}, {"fish": "a\0b"}, {"fish": object()}, {"frame": None},
    {"channels": 5}, {"channels": {"x": 5}}, {"channels": {"x": None}}, {"channels": {5: "m"}},
    {"channels": {"x": {"unit": "m", "scale": 1j}}},
    {"channels": {"x": {"unit": "m", "scale": "["}}},
    {"channels": {"x": {"unit": "m", "scale": object()}}},
    {"channels": {"x": {"unit": "m", "scale": 10**400}}}, {"constant_commands": 5},
    {"constant_commands": {"tail_offset": None}}, {"time": 5}, {"time": {"column": 5}},
    {"time": {"column": "t", "unit": "s", "offset": 1e300}}, {"name": "a\x1b[2J"}, {"name": ""},
    {"start": 5}, {"tail_phase": float("nan")}, {"tail_phase": [0.0]}, {"conditions": 5},
    {"noise": 5}, {"noise": {"x": None}}, {"noise": {"x": -1.0}},
]  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG, ids=range(len(WRONG)))
def test_a_wrong_argument_is_refused(wrong):
    message = fault(from_frames, frame(), **USUAL | DECLARED | wrong)
    assert message
    assert message.isprintable()


def test_numbers_of_numpy_are_numbers():
    scaled = {"x": {"unit": "m", "scale": np.float64(2.0), "sign": np.int64(-1)}}
    given = {"channels": scaled, "noise": {"x": np.float32(0.5)}, "tail_phase": np.float64(0.25)}
    dataset = from_frames(frame(), **USUAL | DECLARED | given)
    np.testing.assert_allclose(dataset.runs[0].channels["x"], -0.2 * TIME, atol=1e-12)
    assert dataset.noise["x"] == 0.5
    assert dataset.runs[0].tail_phase == 0.25
