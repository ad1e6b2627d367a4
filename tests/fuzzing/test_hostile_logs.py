"""Logs that are made to break their readers are refused in one line, in little time and memory."""

import resource
import signal
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fish_env.data.importing import assemble, limits, open_logs, parse_plan
from fish_env.data.importing.correction import corrected
from fish_env.errors import DatasetError
from tests.command_line import run
from tests.fuzzing.hostile_logs import LOGS, MESSAGES, ORDINARY, TOPICS, database, workbook
from tests.fuzzing.readers import LONGEST_S, fault
from tests.fuzzing.test_structured import fuzz

MEMORY = 900_000_000
LIMITS = {
    "limits.MOST_MEMORY": MEMORY,
    "limits.MOST_FILE": 50_000_000,
    "limits.MOST_VALUES": 10_000_000,
    "matlab.MOST_OBJECTS": 1_000,
    "matlab_checks.MOST_UNPACKED": 50_000_000,
    "tables.MOST_UNPACKED": 50_000_000,
}
"""The limits, lowered."""


@pytest.fixture
def little(monkeypatch):
    """Bounds this process once it is called: little memory, little time, and low limits."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    most = pages * resource.getpagesize() + 2 * MEMORY
    for name, value in LIMITS.items():
        monkeypatch.setattr(f"fish_env.data.importing.{name}", value)

    def too_long(*_):
        raise AssertionError("takes too long")

    def bound() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (most, before[1]))
        signal.alarm(round(LONGEST_S) + 5)

    handler = signal.signal(signal.SIGALRM, too_long)
    yield bound
    signal.alarm(0)
    signal.signal(signal.SIGALRM, handler)
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize("log", LOGS)
def test_a_hostile_log_is_refused(log, tmp_path, little):
    name, make, word = LOGS[log]
    make(tmp_path / name)
    little()
    message = fault(open_logs, [tmp_path / name])
    assert word in str(message)
    assert str(message).isprintable()


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> dict[str, bytes]:
    """The content of an ordinary log of each kind, by its ending."""
    folder = tmp_path_factory.mktemp("whole")
    for name, make in ORDINARY.items():
        make(folder / name)
    files = [file for file in folder.rglob("*") if file.is_file() and file.suffix != ".yaml"]
    return {
        file.suffix if file.suffix != ".mat" else file.name[1:]: file.read_bytes() for file in files
    }


@pytest.mark.parametrize("kind", [".csv", "5.mat", "7.mat", ".xlsx", ".parquet", ".mcap", ".db3"])
@fuzz
@given(data=st.data())
def test_damaged_logs(kind, whole, tmp_path_factory, data):
    content = bytearray(whole[kind])
    for _ in range(data.draw(st.integers(1, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file = tmp_path_factory.getbasetemp() / f"damaged{kind}"
    file.write_bytes(content[: data.draw(st.sampled_from([len(content), len(content) // 2]))])
    message = fault(open_logs, [file])
    assert message is None or message.isprintable()


def test_the_limits_of_the_process_are_put_back():
    before = [resource.getrlimit(kind) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    with limits.bounded():
        within = [resource.getrlimit(kind) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    assert all(limit[0] > 0 for limit in within)
    assert within != before
    after = [resource.getrlimit(kind) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    assert after == before


@pytest.mark.parametrize(
    "log", ["~nouser/x.csv", "a\0b.csv", "\ud800.csv", "x" * 300 + ".csv", "/dev/zero", "", "x.csv"]
)
def test_a_path_that_is_no_log_is_refused(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert fault(open_logs, [log])


def test_the_size_that_a_sheet_says_it_has_is_not_believed(tmp_path):
    """Some programs write a size that is too small, and would lose rows; others one too large."""
    for name, size in (("small.xlsx", "A1:B1"), ("large.xlsx", "A1:XFD1048576")):
        workbook("", size)(tmp_path / name)
        (source,), _ = open_logs([tmp_path / name])
        assert {column: len(values) for column, values in source.columns.items()} == {
            "column 1": 3, "column 2": 3,
        }  # fmt: skip


def test_names_cannot_move_the_cursor_or_break_a_line(tmp_path):
    text = 't,"x\x1b[2J","a\nb"\n0,1,2\n1,2,3\n'
    (tmp_path / "x.csv").write_text(text)
    (source,), notes = open_logs([tmp_path / "x.csv"])
    assert list(source.columns) == ["t", "x\\x1b[2J", "a b"]
    assert all(note.isprintable() for note in notes)
    with pytest.raises(DatasetError) as caught:
        source.column("a\x1bc")
    assert str(caught.value).isprintable()


MAPPING = """\
format: robofish-import/1
name: a
fish: zheng-2021-a
frame: ned
sources: {log: {time: {column: t, unit: s}}}
channels: {x: {column: x, unit: m}}
constant_commands: {tail_offset: 0, tail_amplitude: 0, tail_frequency: 0, \
block_displacement: 0, block_angle: 0}
"""
ALIASES = "[&a [1, 1, 1, 1], " + "&b [*a, *a, *a], &c [*b, *b, *b], &d [*c, *c, *c], " * 1 + "*d]"


def swim(folder: Path, rows: int = 50, x: str = "1") -> Path:
    lines = "".join(f"{0.02 * i:.2f},{x},{i}\n" for i in range(rows))
    (folder / "swim.csv").write_text("t,x,run\n" + lines)
    return folder / "swim.csv"


@pytest.mark.parametrize(
    "change",
    [
        ("unit: m}", "unit: m, scale: '['}"),
        ("unit: m}", "unit: m, scale: '1:30'}"),
        ("unit: m}", "unit: m, scale: '1_000'}"),
        ("unit: m}", f"unit: m, scale: '{ALIASES}'}}"),
        ("unit: m}", "unit: m, offset: '!!python/object/apply:os.getcwd []'}"),
        ("unit: m}", "unit: m, sign: .nan}"),
        ("unit: s}", "unit: s, offset: 1e300}"),
        ("unit: s}", "unit: s, offset: 1e10}"),
        ("unit: s}", "unit: '9**9**9**9'}"),
        ("zheng-2021-a", "~nouser/x.yaml"),
        ("zheng-2021-a", '"a\\0b.yaml"'),
        ("zheng-2021-a", '"\\ud800"'),
        ("name: a", 'name: "a\\e[2J"'),
        ("tail_offset: 0", "tail_offset: 12:30"),
        ("tail_offset: 0", "tail_offset: '{a: b'"),
        ("fish:", "run_column: run\nfish:"),
    ],
    ids=range(16),
)
def test_a_hostile_mapping_is_refused(change, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("fish_env.data.importing.grouping.MOST_RUNS", 20)
    (tmp_path / "m.yaml").write_text(MAPPING.replace(*change))
    words = ("--mapping", str(tmp_path / "m.yaml"), "--out", str(tmp_path / "out"))
    status, _, error = run(capsys, "import", str(swim(tmp_path)), *words)
    assert status == 2
    assert error.count("\n") == 1
    assert "Traceback" not in error
    assert not (tmp_path / "out" / "dataset.yaml").exists()


@pytest.mark.parametrize("line", ["fish: ~nouser/x", 'fish: "a\\0b"', "x: {scale: '['}", "[" * 500])
def test_a_hostile_correction_is_refused(line, tmp_path):
    content = {
        "format": "robofish-import/1", "name": "a", "fish": "zheng-2021-a", "frame": "ned",
        "sources": {"log": {"time": {"column": "t", "unit": "s"}}},
        "channels": {"x": {"column": "x", "unit": "m"}},
    }  # fmt: skip
    sources, _ = open_logs([swim(tmp_path)])

    def correct() -> None:
        assemble(parse_plan(corrected(content, line, ["x"]), tmp_path), sources, tmp_path)

    assert fault(correct)


def test_a_column_that_would_make_a_thousand_runs_is_refused(tmp_path):
    swim(tmp_path, rows=limits.MOST_RUNS + 1)
    sources, _ = open_logs([tmp_path / "swim.csv"])
    content = yaml.safe_load(MAPPING) | {"run_column": "run"}
    with pytest.raises(DatasetError, match=r"more than 1000 runs.*--run-column"):
        assemble(parse_plan(content, tmp_path), sources, tmp_path)


def test_grouped_digits_are_no_number(tmp_path):
    (source,), _ = open_logs([swim(tmp_path, x="1_000")])
    with pytest.raises(DatasetError, match=r"row 2.*'1_000' is not a number"):
        source.numbers("x")


def test_times_beyond_64_bits_are_refused(tmp_path):
    rows = "".join(f"{10**17 + i}, 1, 1\n" for i in range(3))
    (tmp_path / "x.csv").write_text("t,x,run\n" + rows)
    sources, _ = open_logs([tmp_path / "x.csv"])
    assert sources[0].columns["t"].dtype == np.int64
    with pytest.raises(DatasetError, match="not a plausible date"):
        assemble(parse_plan(yaml.safe_load(MAPPING), tmp_path), sources, tmp_path)


def test_an_ordinary_database_passes(tmp_path):
    database(TOPICS + MESSAGES)(tmp_path / "x.db3")
    assert open_logs([tmp_path / "x.db3"]) == ((), ("x.db3: /a left out: it holds no message",))
