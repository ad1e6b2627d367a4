"""Corrections by a person, mappings by hand, and pandas frames."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from rich.console import Console

from fish_env.commands.import_logs import Told, import_logs
from fish_env.data import Dataset, from_frames, load_dataset, write_dataset
from fish_env.data.importing import Source, assemble, parse_plan
from fish_env.data.importing.correction import corrected
from fish_env.errors import DatasetError
from tests.command_line import run

TIME = np.arange(100) * 0.04
COMMANDS = {"tail_offset": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0}
CONSTANT = {**COMMANDS, "block_displacement": 0.0, "block_angle": 0.0}


def frame(**columns) -> pd.DataFrame:
    """A swim along x with a turn, and whatever else is given."""
    base = {"t": TIME, "x": 0.1 * TIME, "y": 0.01 * TIME**2, "yaw": 0.2 * TIME}
    return pd.DataFrame({**base, **COMMANDS, **columns})


CONTENT = {
    "format": "robofish-import/1",
    "name": "swim",
    "fish": "zheng-2021-a",
    "frame": "ned",
    "sources": {"log": {"time": {"column": "t", "unit": "s"}}},
    "channels": {"yaw": {"source": "log", "column": "psi", "unit": "rad"}},
    "commands": {"tail_offset": {"source": "log", "column": "cmd", "unit": "deg"}},
    "constant_commands": {n: v for n, v in CONSTANT.items() if n != "tail_offset"},
}


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("yaw: deg", "channels.yaw.unit", "deg"),
        ("yaw: {sign: -1, frame: enu}", "channels.yaw.sign", "-1"),
        ("yaw: {sign: -1}", "channels.yaw.column", "psi"),
        ("yaw: none", "channels.yaw", None),
        ("yaw: other", "channels.yaw.column", "other"),
        ("yaw: other", "channels.yaw.unit", "rad"),
        ("channels: {yaw: {sign: -1}}", "channels.yaw.sign", "-1"),
        ("constant_commands: {tail_offset: 0.1}", "constant_commands.tail_offset", 0.1),
        ("sources: {log: {time: {unit: ms}}}", "sources.log.time.unit", "ms"),
        ("r: {column: gz, unit: dps}", "channels.r.column", "gz"),
        ("tail_offset: 0.1", "constant_commands.tail_offset", 0.1),
        ("tail_offset: 0.1", "commands.tail_offset", None),
        ("tail_frequency: {column: f, unit: Hz}", "constant_commands.tail_frequency", None),
        ("log: {time: {unit: ms}}", "sources.log.time.unit", "ms"),
        ("log: {time: {unit: ms}}", "sources.log.time.column", "t"),
        ("frame: enu", "frame", "enu"),
        ("run_column: trial", "run_column", "trial"),
    ],
)
def test_a_correction_changes_one_thing(text, path, value):
    before = yaml.safe_dump(CONTENT)
    found = corrected(CONTENT, text, {"psi", "other"})
    for key in path.split("."):
        found = found.get(key) if isinstance(found, dict) else found
    assert found == value
    assert yaml.safe_dump(CONTENT) == before


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("yow: deg", "'yaw'"),
        ("yaw deg", "key: value"),
        ("{", "YAML"),
        ("yaw: [", "YAML"),
        ("channels: {yow: deg}", "'yaw'"),
        ("channels: deg", "'channels' is not known"),
    ],
)
def test_a_correction_that_says_nothing_is_refused(text, expected):
    with pytest.raises(DatasetError, match=expected):
        corrected(CONTENT, text)


def converse(tmp_path: Path, data: pd.DataFrame, *answers: str) -> tuple[object, str]:
    """What comes of answering the questions of an import, and what was shown."""
    data.to_csv(tmp_path / "swim.csv", index=False)
    given, asked = iter(answers), []

    def ask(question: str) -> str:
        asked.append(question)
        return next(given)

    console = Console(width=200, record=True, quiet=False)
    logs, out = [str(tmp_path / "swim.csv")], tmp_path / "out"
    result = import_logs(console, logs, out, None, Told(), False, ask)
    assert next(given, None) is None, "a question was not asked"
    return result, console.export_text()


def test_a_person_corrects_and_confirms(tmp_path):
    data = frame(yaw=0.001 * TIME).rename(columns={"yaw": "psi"})
    result, shown = converse(
        tmp_path, data, "yes", "fish: zheng-2021-a", "frame: enu", "yow: deg", "psi: none",
        "yaw: {unit: deg, sign: -1}", "y",
    )  # fmt: skip
    assert result is not None
    for words in ("not yet complete", "'yaw'", "import-swim.png", "psi times -1"):
        assert words in shown
    dataset = load_dataset(tmp_path / "out")
    yaw = np.pi / 2 + np.radians(0.001 * TIME)
    np.testing.assert_allclose(dataset.runs[0].channels["yaw"], yaw, rtol=1e-12)
    mapping = yaml.safe_load((tmp_path / "out" / "import.yaml").read_text())
    assert mapping["channels"]["yaw"]["sign"] == -1


def test_a_person_says_no(tmp_path):
    result, shown = converse(tmp_path, frame(), "fish: zheng-2021-a", "frame: ned", "no")
    assert result is None
    assert "no dataset is written" in shown
    assert not (tmp_path / "out" / "dataset.yaml").exists()


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--frame", "ned"), ["fish", "--fish"]),
        (("--fish", "zheng-2021-a"), ["frame", "--frame ned (x north"]),
        (("--fish", "zheng-2021-a", "--frame", "nwu"), ["key frame", "ned, enu"]),
        (("--fish", "zheng-2021-b", "--frame", "ned", "--run-column", "no"), ["no such column"]),
    ],
)
def test_what_cannot_be_guessed_is_asked_for_and_the_rest_kept(tmp_path, capsys, options, expected):
    frame().to_csv(tmp_path / "swim.csv", index=False)
    out = tmp_path / "out"
    arguments = ("import", str(tmp_path / "swim.csv"), "--out", str(out), "--yes", *options)
    status, _, err = run(capsys, *arguments)
    assert status == 2
    assert all(words in err for words in [*expected, "--mapping"]), err
    kept = yaml.safe_load((out / "import.yaml").read_text())
    assert kept["channels"]["x"] == {"source": "log", "column": "x", "unit": "m"}
    # It is not written over: a person may have begun to complete it.
    (out / "import.yaml").write_text("mine")
    status, _, err = run(capsys, *arguments)
    assert (status, (out / "import.yaml").read_text()) == (2, "mine")
    assert "this mapping already exists" in err


def test_no_file_is_ever_written_over(tmp_path, capsys):
    log = tmp_path / "swim.csv"
    frame().to_csv(log, index=False)
    before = log.read_bytes()
    told = ("--fish", "zheng-2021-a", "--frame", "ned", "--yes")
    status, _, err = run(capsys, "import", str(log), "--out", str(tmp_path), *told)
    assert status == 2
    assert "swim.csv already exists" in err
    assert log.read_bytes() == before
    assert not (tmp_path / "dataset.yaml").exists()


def test_a_fish_of_ones_own_is_found_from_wherever_the_dataset_lies(tmp_path, capsys, monkeypatch):
    (tmp_path / "log").mkdir()
    frame().to_csv(tmp_path / "log" / "swim.csv", index=False)
    (tmp_path / "mine.yaml").write_text("name: mine\nbase: zheng-2021-a\n")
    monkeypatch.chdir(tmp_path)
    told = ("--fish", "mine.yaml", "--frame", "ned", "--yes")
    assert run(capsys, "import", "log/swim.csv", "--out", "a/b", *told)[0] == 0
    monkeypatch.chdir(tmp_path / "log")
    again = ("--out", "../c", "--mapping", "../a/b/import.yaml")
    assert run(capsys, "import", "swim.csv", *again)[0] == 0
    for folder in ("a/b", "c"):
        assert load_dataset(tmp_path / folder).fish == str(tmp_path / "mine.yaml")


def test_a_log_without_anything_known_is_refused_in_one_line(tmp_path, capsys):
    pd.DataFrame({"t": TIME, "battery": TIME}).to_csv(tmp_path / "swim.csv", index=False)
    told = ("--fish", "zheng-2021-a", "--frame", "ned", "--yes")
    out = str(tmp_path / "out")
    status, shown, err = run(capsys, "import", str(tmp_path / "swim.csv"), "--out", out, *told)
    assert status == 2
    assert "no channel is mapped" in err
    assert "not used: battery" in shown


@pytest.mark.parametrize(
    ("stamp", "name", "expected"),
    [
        ("01.05.2026 10:00:0{}", "stamp", ["column stamp", "'01.05.2026 10:00:00'", "ISO 8601"]),
        ("{}", "beat", ["no column is named as a time among beat, x", "time_ms", "--mapping"]),
    ],
)
def test_logs_without_a_readable_time_are_refused_by_that_name(
    tmp_path, capsys, stamp, name, expected
):
    rows = "".join(f"{stamp.format(i)},{i}\n" for i in range(5))
    (tmp_path / "swim.csv").write_text(f"{name},x\n{rows}")
    told = ("--fish", "zheng-2021-a", "--frame", "ned", "--yes")
    out = tmp_path / "out"
    status, _, err = run(capsys, "import", str(tmp_path / "swim.csv"), "--out", str(out), *told)
    assert status == 2
    assert all(words in err for words in expected), err
    assert not out.exists()


def test_values_that_contradict_their_unit_are_refused_before_anything_is_written(tmp_path, capsys):
    frame(yaw=40 * np.sin(TIME)).to_csv(tmp_path / "swim.csv", index=False)
    mapping = tmp_path / "m.yaml"
    entries = {name: {"column": name, "unit": unit} for name, unit in (("x", "m"), ("yaw", "rad"))}
    mapping.write_text(
        yaml.safe_dump(
            {**CONTENT, "channels": entries, "commands": {}, "constant_commands": CONSTANT}
        )
    )
    out = tmp_path / "out"
    arguments = (str(tmp_path / "swim.csv"), "--out", str(out), "--mapping", str(mapping))
    status, _, err = run(capsys, "import", *arguments)
    assert status == 2
    assert "can only be degrees" in err
    assert not out.exists()


def sources(**clocks) -> list[Source]:
    """A log of 4 s at 25 Hz, and a servo whose command changes at 1.01 s."""
    log = {"t": TIME, "psi": 0.1 * TIME} | clocks.get("log", {})
    servo = {"t": np.array([0.0, 1.01, 3.0]), "cmd": np.array([0.0, 10.0, 30.0])}
    return [
        Source(Path("a.mat"), "log", log),
        Source(Path("a.mat"), "servo", servo | clocks.get("servo", {})),
    ]


def two_clocks(between: str = "hold", **servo_time) -> dict:
    command = {"source": "servo", "column": "cmd", "unit": "deg", "between": between}
    time = {"column": "t", "unit": "s"}
    return {
        **CONTENT,
        "sources": {
            "log": {"part": "log", "time": time},
            "servo": {"part": "servo", "time": {**time, **servo_time}},
        },
        "commands": {"tail_offset": command},
    }


def offsets(content: dict, tables: list[Source], at: list[float]) -> np.ndarray:
    imported = assemble(parse_plan(content, Path("m.yaml")), tables, Path("out"))
    return np.degrees(imported.dataset.runs[0].commands.at(at)[:, 0])


def test_a_command_on_another_clock_holds_or_is_resampled_as_told():
    at = [0.96, 1.0, 1.01, 1.04, 2.0, 3.04]
    np.testing.assert_allclose(
        offsets(two_clocks(), sources(), at), [0.0, 0.0, 10.0, 10.0, 10.0, 30.0]
    )
    np.testing.assert_allclose(
        offsets(two_clocks("linear"), sources(), at),
        np.interp([0.96, 1.0, 1.0, 1.04, 2.0, 3.04], [0.0, 1.01, 3.0], [0.0, 10.0, 30.0]),
    )


def test_an_offset_of_a_column_is_kept(tmp_path):
    content = two_clocks()
    content["channels"] = {"yaw": {**CONTENT["channels"]["yaw"], "scale": -1, "offset": 0.25}}
    imported = assemble(parse_plan(content, Path("m.yaml")), sources(), tmp_path)
    kept = imported.description["channels"]["yaw"]
    assert yaml.safe_load(yaml.safe_dump(kept)) == {"scale": -1, "offset": 0.25, "unit": "rad"}
    found = imported.dataset.runs[0].channels["yaw"]
    np.testing.assert_allclose(found[[0, -1]], 0.25 - 0.1 * TIME[[0, -1]])


def test_a_clock_may_be_shifted():
    content = two_clocks(offset=0.5)
    np.testing.assert_allclose(offsets(content, sources(), [1.5, 1.52]), [0.0, 10.0])
    imported = assemble(parse_plan(content, Path("m.yaml")), sources(), Path("out"))
    assert "first commanded 0.5 s after" in imported.notes[0]


@pytest.mark.parametrize(
    ("clocks", "expected"),
    [
        ({"servo": {"t": 1.7e9 + np.arange(3.0)}}, "counts from a date"),
        ({"servo": {"t": 60.0 + np.arange(3.0)}}, "never meet"),
        ({"servo": {"t": np.array([0.0, 2.0, 1.0])}}, "does not increase"),
        ({"servo": {"t": np.array([0.0, 2.0, 2.0])}}, "time of the row before"),
        ({"servo": {"cmd": np.full(3, np.nan)}}, "no value of tail_offset"),
        ({"servo": {"cmd": np.array(["a", "b", "c"], object)}}, "'a' is not a number"),
        ({"log": {"psi": np.full(100, 40.0)}}, "more than a fish"),
    ],
)
def test_sources_that_do_not_fit_together_are_refused(clocks, expected):
    with pytest.raises(DatasetError, match=expected):
        offsets(two_clocks(), sources(**clocks), [0.0])


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"format": "robofish-import/2"}, "key format"),
        ({"chanels": {}}, "'channels'"),
        ({"channels": {"psi": {"column": "psi", "unit": "rad"}}}, "unknown channel"),
        ({"channels": {"yaw": {"column": "psi"}}}, "key channels.yaw.unit"),
        ({"channels": {"yaw": {"column": "psi", "unit": "rad", "between": "hold"}}}, "between"),
        ({"channels": {"yaw": {"column": "psy", "unit": "rad"}}}, "'psi'"),
        ({"channels": {"yaw": {"source": "lag", "column": "psi", "unit": "rad"}}}, "'log'"),
        ({"sources": {"log": {"time": {"column": "t"}}}}, "key sources.log.time.unit"),
        ({"sources": {"log": {"files": "b*", "time": {"column": "t", "unit": "s"}}}}, "no table"),
        ({"constant_commands": {}}, "tail_amplitude"),
        ({"runs": [{"id": "a", "files": ["b*"]}]}, "0 tables of source log"),
    ],
)
def test_a_mapping_that_is_wrong_is_refused_by_name(change, expected):
    log = Source(Path("a.csv"), "", {"t": TIME, "psi": 0.1 * TIME, "cmd": 0.0 * TIME})
    with pytest.raises(DatasetError, match=expected):
        offsets({**CONTENT, **change}, [log], [0.0])


def test_files_that_do_not_pair_are_named_and_can_be_told():
    log, servo = sources()
    tables = [
        Source(Path(name), source.part, source.columns)
        for name, source in (("x7.mat", log), ("x9.mat", log), ("q1.mat", servo), ("q2.mat", servo))
    ]
    with pytest.raises(DatasetError, match=r"2 of log, 2 of servo.* runs: "):
        offsets(two_clocks(), tables, [0.0])
    told = [{"id": "a", "files": ["x7.mat", "q2.mat"], "condition": "slow"}]
    plan = parse_plan({**two_clocks(), "runs": told}, Path("m.yaml"))
    dataset = assemble(plan, tables, Path("out")).dataset
    assert (dataset.ids, dataset.conditions) == (("a",), ("slow",))


def test_frames_become_a_dataset(tmp_path):
    data = frame(yaw=np.degrees(0.2 * TIME), x=-100.0 * TIME)
    dataset = from_frames(
        {"a": data.rename(columns={"t": "clock"}), "b": data.rename(columns={"t": "clock"})},
        fish="zheng-2021-a",
        frame="ned",
        time={"column": "clock", "unit": "s"},
        channels={"x": {"sign": -1, "scale": 0.1, "unit": "cm"}, "yaw": "degrees"},
        commands={"tail_offset": "rad", "tail_amplitude": "rad", "tail_frequency": "hz"},
        constant_commands={"block_displacement": 0.0, "block_angle": 0.0},
        conditions={"a": "straight"},
        tail_phase=0.0,
        noise={"yaw": 1.0},
    )
    assert dataset.ids == ("a", "b")
    assert dataset.conditions == ("straight", None)
    np.testing.assert_allclose(dataset.runs[0].channels["x"], 0.1 * TIME, rtol=1e-12)
    np.testing.assert_allclose(dataset.runs[1].channels["yaw"], 0.2 * TIME, rtol=1e-12)
    np.testing.assert_allclose(dataset.noise["yaw"], np.radians(1.0))
    assert load_dataset(write_dataset(dataset, tmp_path / "d")) == dataset


def test_frames_on_clocks_of_their_own_each_have_a_name():
    begin = pd.Timestamp("2026-05-01T12:00:00Z")
    pose = frame(t=begin + pd.to_timedelta(TIME, unit="s")).set_index("t")[["x", "yaw"]]
    stamps = begin + pd.to_timedelta([0.0, 1.01], unit="s")
    servo = pd.DataFrame({"t": stamps, "cmd": [0.0, 10.0]})
    dataset = from_frames(
        {"a": {"pose": pose, "servo": servo}},
        fish="zheng-2021-a",
        frame="ned",
        channels={"yaw": {"source": "pose", "unit": "rad"}},
        commands={"tail_offset": {"source": "servo", "column": "cmd", "unit": "deg"}},
        constant_commands={n: v for n, v in CONSTANT.items() if n != "tail_offset"},
    )
    np.testing.assert_allclose(dataset.runs[0].commands.times_s, [0.0, 1.01], atol=1e-9)
    assert dataset.runs[0].time_s[0] == 0.0


def test_frames_are_guessed_with_a_warning_that_says_how():
    with pytest.warns(UserWarning, match=r"give `channels`.*yaw: unit deg assumed"):
        dataset = from_frames(frame(yaw=20 * np.sin(TIME)), fish="zheng-2021-a", frame="ned")
    assert isinstance(dataset, Dataset)
    assert any("yaw: unit deg assumed" in note for note in dataset.notes)
    assert any("unless start='rest'" in note for note in dataset.notes)
    np.testing.assert_allclose(dataset.runs[0].channels["yaw"], np.radians(20 * np.sin(TIME)))


@pytest.mark.parametrize(
    ("data", "time", "expected"),
    [
        (frame(t=1000 * TIME), None, r"looks like a time in ms.*'unit': 'ms'"),
        (frame(), "stamp", "no column 'stamp' holds the times.*one of: t, x"),
        (frame(yaw="east"), None, "'east' is not a number"),
        (frame(yaw=[np.nan] * 50 + [40.0] * 50), None, "more than a fish"),
        (frame().iloc[:1], None, "1 rows"),
    ],
)
def test_frames_that_are_wrong_are_refused(data, time, expected):
    told = {"fish": "zheng-2021-a", "frame": "ned", "time": time, "constant_commands": CONSTANT}
    with pytest.raises(DatasetError, match=expected):
        from_frames(data, channels={"x": "m", "yaw": "rad"}, **told)
