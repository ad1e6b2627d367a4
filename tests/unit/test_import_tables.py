"""Text tables, Excel and Parquet files, written by the libraries that people use."""

import csv
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fish_env.data import Dataset, load_dataset
from fish_env.data.importing import open_logs
from fish_env.errors import DatasetError
from tests.command_line import run
from tests.fixtures.foreign_logs import EPOCH_NS, Swim, swim

COMMON = ("--fish", "zheng-2021-a", "--yes")
NAMES = ("x", "y", "depth", "yaw", "r")


@pytest.fixture(scope="module")
def motion() -> Swim:
    return swim()


def table(motion: Swim) -> pd.DataFrame:
    """The swim as a team may log it: millimetres, degrees, commands in every row."""
    commands = motion.commands[
        np.searchsorted(motion.command_times_s, motion.time_s, side="right") - 1
    ]
    c = motion.channels
    return pd.DataFrame(
        {
            "Time [ms]": np.rint(motion.time_s * 1000).astype(int),
            "Pos X [mm]": 1000 * c["x"],
            "Pos Y [mm]": 1000 * c["y"],
            "Depth [cm]": 100 * (c["z"] + 0.4),
            "Yaw [deg]": np.degrees(c["yaw"]),
            "gyro_z_dps": np.degrees(c["r"]),
            "tail offset (°)": np.degrees(commands[:, 0]),
            "tail amplitude (°)": np.degrees(commands[:, 1]),
            "tail frequency (Hz)": commands[:, 2],
            "comment": "a note",
        }
    )


def imported(capsys, tmp_path: Path, *logs: str, frame: str | None = "ned") -> Dataset:
    told = () if frame is None else ("--frame", frame)
    out = tmp_path / "out"
    status, _, err = run(capsys, "import", *logs, "--out", str(out), *COMMON, *told)
    assert not err
    assert status == 0
    dataset = load_dataset(out)
    assert isinstance(dataset, Dataset)
    return dataset


def check_truth(run, motion: Swim, atol: float = 1e-9) -> None:
    np.testing.assert_allclose(run.time_s, motion.time_s, atol=1e-9)
    truth = motion.channels | {"z": motion.channels["z"] + 0.4}
    for name in ("x", "y", "z", "yaw", "r"):
        np.testing.assert_allclose(run.channels[name], truth[name], atol=atol)
    # Every command is logged with the next sample.
    late = run.commands.times_s - motion.command_times_s
    assert np.all((late >= -1e-9) & (late < 0.04))
    np.testing.assert_allclose(run.commands.values, motion.commands, atol=atol)


def stamps(motion: Swim, form: str) -> list[str]:
    begin = datetime(2026, 5, 1, 23, 59, 58, tzinfo=UTC)
    times = [begin + timedelta(seconds=round(t, 6)) for t in motion.time_s]
    if form == "iso":
        return [time.isoformat().replace("+00:00", "Z") for time in times]
    factor = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[form]
    return [f"{round(time.timestamp() * factor, 3):.6f}" for time in times]


def write_text(file: Path, data: pd.DataFrame, separator: str, decimal: str, **how) -> Path:
    data.to_csv(
        file, sep=separator, decimal=decimal, index=False, encoding=how.get("encoding", "utf-8")
    )
    preamble = how.get("preamble", "")
    if preamble:
        file.write_text(preamble + file.read_text())
    return file


@pytest.mark.parametrize(
    ("separator", "decimal", "how"),
    [
        (",", ".", {}),
        (";", ",", {"encoding": "cp1252"}),
        (",", ",", {}),
        ("\t", ",", {"encoding": "utf-16"}),
        ("|", ".", {"encoding": "utf-8-sig"}),
        (";", ".", {"preamble": "% Recorded by A. B.\n% tank 2, 20 degrees\n\n"}),
    ],
)
def test_a_text_table_of_any_shape(tmp_path, capsys, motion, separator, decimal, how):
    file = write_text(tmp_path / "swim.csv", table(motion), separator, decimal, **how)
    check_truth(imported(capsys, tmp_path, str(file)).runs[0], motion)


def test_spaces_a_header_behind_a_sign_and_units_below(tmp_path, capsys, motion):
    data = table(motion).drop(columns="comment")
    names = [
        "t",
        "x",
        "y",
        "depth",
        "yaw",
        "gyro_z",
        "tail_offset",
        "tail_amplitude",
        "tail_frequency",
    ]
    units = ["ms", "mm", "mm", "cm", "deg", "deg/s", "deg", "deg", "Hz"]
    rows = [" ".join(f"{v:.12g}" for v in row) for row in data.to_numpy()]
    file = tmp_path / "swim.txt"
    file.write_text("\n".join(["# " + " ".join(names), "# " + " ".join(units), *rows]) + "\n")
    check_truth(imported(capsys, tmp_path, str(file)).runs[0], motion)


@pytest.mark.parametrize("form", ["iso", "s", "ms", "us", "ns"])
def test_clocks_that_count_from_a_date(tmp_path, capsys, motion, form):
    data = table(motion).rename(columns={"Time [ms]": "timestamp"})
    data["timestamp"] = stamps(motion, form)
    file = write_text(tmp_path / "swim.csv", data, ",", ".")
    measured = imported(capsys, tmp_path, str(file)).runs[0]
    # A float of nanoseconds since 1970 is good to a quarter of a microsecond.
    np.testing.assert_allclose(measured.time_s, motion.time_s, atol=1e-6)


@pytest.mark.parametrize(("factor", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_the_unit_of_a_clock_is_guessed_from_its_steps(tmp_path, capsys, motion, factor, unit):
    data = table(motion).rename(columns={"Time [ms]": "time"})
    data["time"] = motion.time_s * factor
    file = write_text(tmp_path / "swim.csv", data, ",", ".")
    out = tmp_path / "out"
    _, shown, _ = run(capsys, "import", str(file), "--out", str(out), *COMMON, "--frame", "ned")
    assert f"its time is 'time', unit {unit} (a usual step" in " ".join(shown.split())
    check_truth(load_dataset(out).runs[0], motion)


def test_runs_in_one_table(tmp_path, capsys):
    motions = [swim(0), swim(1)]
    data = pd.concat([table(m).assign(trial=i + 1) for i, m in enumerate(motions)])
    file = write_text(tmp_path / "all.csv", data, ",", ".")
    dataset = imported(capsys, tmp_path, str(file))
    assert dataset.ids == ("1", "2")
    for measured, motion in zip(dataset.runs, motions, strict=True):
        check_truth(measured, motion)


def test_a_pattern_names_runs_by_their_files(tmp_path, capsys, motion):
    for i in (10, 2):
        write_text(tmp_path / f"run{i}.csv", table(motion if i == 2 else swim(1)), ",", ".")
    dataset = imported(capsys, tmp_path, str(tmp_path / "run*.csv"))
    assert dataset.ids == ("run2", "run10")
    check_truth(dataset.run("run10"), swim(1))


@pytest.mark.parametrize("where", ["{kind}_{run}.csv", "{run}/{kind}.csv"])
def test_commands_in_files_of_their_own(tmp_path, capsys, where):
    motions = {"a": swim(0), "b": swim(1)}
    for name, motion in motions.items():
        pose = table(motion).iloc[:, :6]
        servo = pd.DataFrame(
            {
                "t_us": np.rint(motion.command_times_s * 1e6).astype(int),
                "offset_cmd_rad": motion.commands[:, 0],
                "amplitude_cmd_rad": motion.commands[:, 1],
                "frequency_cmd": motion.commands[:, 2],
            }
        )
        for kind, data in (("pose", pose), ("servo", servo)):
            file = tmp_path / where.format(kind=kind, run=name)
            file.parent.mkdir(exist_ok=True)
            write_text(file, data, ",", ".")
    logs = str(tmp_path / where.format(kind="*", run="*"))
    dataset = imported(capsys, tmp_path, logs)
    assert dataset.ids == ("a", "b")
    for name, motion in motions.items():
        measured = dataset.run(name)
        np.testing.assert_allclose(measured.commands.times_s, motion.command_times_s, atol=1e-9)
        np.testing.assert_allclose(measured.commands.values, motion.commands, atol=1e-12)
        present = np.isfinite(measured.channels["x"])
        np.testing.assert_allclose(measured.channels["x"][present], motion.channels["x"], atol=1e-9)


def test_excel_with_a_sheet_a_run_and_dates(tmp_path, capsys):
    motions = {"first": swim(0), "second": swim(1)}
    file = tmp_path / "trials.xlsx"
    begin = datetime(2026, 5, 1, 12)
    with pd.ExcelWriter(file) as writer:
        for name, motion in motions.items():
            data = table(motion).rename(columns={"Time [ms]": "time"})
            data["time"] = [begin + timedelta(milliseconds=round(1000 * t)) for t in motion.time_s]
            data.to_excel(writer, sheet_name=name, index=False, startrow=2)
        pd.DataFrame().to_excel(writer, sheet_name="empty")
    dataset = imported(capsys, tmp_path, str(file))
    assert dataset.ids == ("first", "second")
    for name, motion in motions.items():
        check_truth(dataset.run(name), motion)


def test_excel_formulas_give_their_saved_values_only(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["t", "x"])
    for row in range(3):
        book.active.append([row, "=1+1"])
    book.save(tmp_path / "f.xlsx")
    (source,), _ = open_logs([tmp_path / "f.xlsx"])
    # Nobody has calculated them, and nothing here does.
    assert np.isnan(source.numbers("x")).all()


@pytest.mark.parametrize("dated", [True, False])
def test_parquet(tmp_path, capsys, motion, dated):
    data = table(motion)
    if dated:
        data = data.rename(columns={"Time [ms]": "stamp"})
        ns = EPOCH_NS + np.rint(motion.time_s * 1e9).astype(np.int64)
        data["stamp"] = pd.to_datetime(ns, unit="ns", utc=True)
    data.to_parquet(tmp_path / "swim.parquet")
    check_truth(imported(capsys, tmp_path, str(tmp_path / "swim.parquet")).runs[0], motion)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.csv", b"", ["a.csv", "rows of values"]),
        ("a.csv", b"t,x\n1,2\n", ["1 rows of values"]),
        ("a.csv", b"t,x,x\n1,2,3\n2,3,4\n", ["column x", "two columns"]),
        ("a.csv", b"t,x\n1,2\n2,3,4\n3,4\n", ["row 3", "3 cells"]),
        ("a.csv", b"\0\xff\xfe\0", ["no text"]),
        ("a.xlsx", b"PK", ["a.xlsx", "Excel workbook"]),
        ("a.parquet", b"PAR1", ["a.parquet", "Parquet file"]),
        ("a.mat", b"MATLAB 7.3", ["a.mat", "MATLAB file"]),
        ("a.mat", b"MATLAB 5.0", ["a.mat", "MATLAB file"]),
        ("a.xls", b"x", ["'.xls'", ".xlsx"]),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(tmp_path, name, content, expected):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DatasetError) as caught:
        open_logs([tmp_path / name])
    assert all(words in str(caught.value) for words in expected), caught.value
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("ending", "package"),
    [(".bag", "rosbags"), (".xlsx", "openpyxl"), (".parquet", "pyarrow"), (".mat", "h5py")],
)
def test_a_missing_package_is_named_with_its_extra(tmp_path, ending, package):
    file = tmp_path / f"a{ending}"
    file.write_bytes(b"MATLAB 7.3")
    code = (
        f"import sys; sys.modules['{package}'] = None\n"
        "from fish_env.data.importing import open_logs\n"
        f"try: open_logs([{str(file)!r}])\n"
        "except ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert f"'{package}'" in done.stdout
    assert 'pip install "h5py' in done.stdout


def test_a_pickle_in_a_matlab_file_is_not_loaded(tmp_path):
    class Evil:
        def __reduce__(self):
            return (Path(tmp_path / "run").touch, ())

    np.save(tmp_path / "a.npy", np.array([Evil()], dtype=object), allow_pickle=True)
    (tmp_path / "b.mat").write_bytes((tmp_path / "a.npy").read_bytes())
    with pytest.raises(DatasetError):
        open_logs([tmp_path / "b.mat"])
    assert not (tmp_path / "run").exists()


def test_a_cell_that_is_no_number_is_named(tmp_path, capsys, motion):
    data = table(motion).astype(object)
    data.loc[3, "Pos X [mm]"] = "lost"
    file = write_text(tmp_path / "swim.csv", data, ",", ".")
    out = tmp_path / "out"
    mapping = tmp_path / "m.yaml"
    channels = "channels: {x: {column: 'Pos X [mm]', unit: mm}}\n"
    mapping.write_text(
        "format: robofish-import/1\nname: a\nfish: zheng-2021-a\nframe: ned\n"
        "sources: {log: {time: {column: 'Time [ms]', unit: ms}}}\n"
        + channels
        + "constant_commands: {tail_offset: 0, tail_amplitude: 0, tail_frequency: 0, "
        "block_displacement: 0, block_angle: 0}\n"
    )
    status, _, err = run(capsys, "import", str(file), "--out", str(out), "--mapping", str(mapping))
    assert status == 2
    assert "row 5" in err
    assert "'lost'" in err
    with file.open() as stream:
        assert list(csv.reader(stream))[4][1] == "lost"
