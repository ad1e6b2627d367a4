"""What every command does alike: version, completion, `-`, `--json`, Ctrl-C."""

import io
import json
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.main import get_command

from fish_env.cli import app
from fish_env.files import check_outputs, write_text
from fish_env.params import config_root
from tests.command_line import run
from tests.fixtures.measured_data import good_folder

CASE = {
    "fish": "zheng-2021-a",
    "duration_s": 0.3,
    "schedule": [{"t": 0, "tail_amplitude": 0.3, "tail_frequency": 1.0}],
}
WITHOUT_RESULTS = {"plot", "replay"}
"""Commands that print no more than the names of the files they write."""


@pytest.fixture
def standard_input(monkeypatch):
    def put(text: str) -> None:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))

    return put


def test_the_version_is_that_of_the_package(capsys):
    status, out, _ = run(capsys, "--version")
    assert (status, out.strip()) == (0, f"robotic-fish {version('robotic-fish')}")


def test_the_shell_completes_the_commands(capsys, monkeypatch):
    monkeypatch.setenv("_ROBOFISH_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "robofish dia")
    monkeypatch.setenv("COMP_CWORD", "1")
    _, out, _ = run(capsys)
    assert out.split() == ["diagnose"]


def test_every_command_that_prints_results_writes_numbers():
    commands = get_command(app).commands  # those of other packages too
    assert set(commands) > WITHOUT_RESULTS
    options = {n: {o for p in c.params for o in p.opts} for n, c in commands.items()}
    without = {name for name, known in options.items() if "--json" not in known}
    assert without == WITHOUT_RESULTS


def test_a_motion_as_numbers_takes_the_place_of_the_table(tmp_path, capsys):
    case = tmp_path / "case.json"
    case.write_text(json.dumps(CASE))
    _, table, _ = run(capsys, "simulate", str(case))
    status, out, err = run(capsys, "simulate", str(case), "--json", "-")
    assert (status, err) == (0, "")
    columns = json.loads(out)["columns"]
    assert list(columns) == table.partition("\n")[0].split(",")
    assert [f"{x:.17g}" for x in columns["x"]] == [r.split(",")[1] for r in table.split()[1:]]
    status, _, err = run(capsys, "simulate", str(case), "--json", str(case))
    assert (status, "is read and would be replaced" in err) == (2, True)


def test_an_import_as_numbers(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("swim.csv").write_text("t,x\n" + "".join(f"{i / 10},{i / 100}\n" for i in range(30)))
    told = ("--fish", "zheng-2021-a", "--frame", "ned", "--mapping", "map.yaml")
    Path("map.yaml").write_text(
        "format: robofish-import/1\nname: a\nsources: {log: {time: {column: t, unit: s}}}\n"
        "channels: {x: {source: log, column: x, unit: m}}\ncommands: {}\n"
        "constant_commands: {tail_offset: 0, tail_amplitude: 0.3, tail_frequency: 1, "
        "block_displacement: 0, block_angle: 0}\n"
    )
    for target in ("swim.csv", "map.yaml"):
        status, _, err = run(capsys, "import", "swim.csv", "--out", "a", *told, "--json", target)
        assert (status, "is read and would be replaced" in err) == (2, True)
    assert not Path("a").exists()
    status, out, err = run(capsys, "import", "swim.csv", "--out", "a", *told, "--json", "-")
    assert status == 0, err
    found = json.loads(out)
    assert found["runs"] == [{"id": "swim", "duration_s": 2.9, "rows": 30, "command_changes": 0}]
    assert found["description"]["channels"] == {"x": "m"}


def test_numbers_go_to_standard_output_alone(capsys):
    status, out, err = run(capsys, "effects", "--json", "-")
    assert status == 0
    assert json.loads(out)["servo_lag"]["parameters"]["time_constant"]["unit"] == "s"
    assert "servo_lag" in err
    _, out, _ = run(capsys, "leaderboard", "--json", "-")
    assert json.loads(out)["results"]


def test_a_campaign_does_not_replace_its_data(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(config_root() / "datasets" / "demo-trials", "demo-trials")
    for target in ("demo-trials/dataset.yaml", "demo-trials/dive.csv"):
        status, _, err = run(capsys, "campaign", "demo-trials", "--out", "out", "--json", target)
        assert status == 2
        assert "is read and would be replaced" in err
    assert not Path("out").exists()


def test_info_as_numbers(tmp_path, capsys):
    target = tmp_path / "fish.json"
    assert run(capsys, "info", "--json", str(target))[0] == 0
    found = json.loads(target.read_text())
    assert found["parameters"]["mass.total"]["unit"] == "kg"


def test_a_swim_goes_through_a_pipe_into_a_page(capsys, standard_input):
    standard_input(json.dumps(CASE))
    status, table, _ = run(capsys, "simulate", "-", "--out", "-", "--rate", "20")
    assert status == 0
    assert table.startswith("t,x,y,z,")
    standard_input(table)
    status, page, err = run(capsys, "replay", "-", "--out", "-")
    assert status == 0
    assert page.startswith("<!")
    assert "robofish:" not in err


@pytest.mark.parametrize("text", ["", "no JSON", "[" * 100_000, "\ud7ff"])
def test_bad_standard_input_is_one_line(text, capsys, standard_input):
    standard_input(text)
    for arguments in (("simulate", "-"), ("replay", "-", "--out", "-")):
        status, _, err = run(capsys, *arguments)
        assert status == 2
        assert err.startswith("robofish: ")
        assert err.count("\n") == 1
        standard_input(text)


def test_two_outputs_cannot_both_be_standard_output():
    from fish_env.errors import OutputError

    with pytest.raises(OutputError, match="two outputs"):
        check_outputs(["-", "-"])


def test_text_goes_to_standard_output(capfd):
    write_text("-", "größer\n")
    assert capfd.readouterr().out == "größer\n"


def test_ctrl_c_says_what_was_kept(capsys, monkeypatch):
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fish_env.commands.effects.print_effects", stopped)
    status, _, err = run(capsys, "effects", "--json", "all effects.json")
    assert status == 130
    assert err.count("\n") == 1
    assert "none is half written" in err
    assert err.endswith("Start again with: robofish effects --json 'all effects.json'\n")
    monkeypatch.setattr("fish_env.commands.diagnose.diagnose", stopped)
    status, _, err = run(capsys, "diagnose", "msu-steady", "--out", "out/none")
    assert status == 130
    assert "out/none is as it was" in err
    monkeypatch.setattr("robofish_agents.training.command.train", stopped)
    status, _, err = run(capsys, "train", "ppo-hold", "--out", "out/none")
    assert status == 130
    assert "start again: robofish train ppo-hold --out out/none" in " ".join(err.split())


def test_compare_leads_with_its_findings_and_names_diagnose(tmp_path, capsys):
    runs = [{"id": "[/red]", "file": "r01.csv", "start": "rest", "tail_phase": 0.0}]
    folder = good_folder(tmp_path / "my pool", runs=runs, name="$\\frac{ [bold]")
    status, out, err = run(capsys, "compare", str(folder), "--out", str(tmp_path / "pictures"))
    assert (status, err) == (0, "")
    assert 0 < out.index("•") < out.index("By condition") < out.index("robofish diagnose")
    assert "[/red]" in out


def test_a_reader_that_has_seen_enough_is_no_error(tmp_path):
    case = tmp_path / "case.json"
    case.write_text(json.dumps({**CASE, "duration_s": 60.0}))
    robofish = [sys.executable, "-m", "fish_env.cli", "simulate", str(case), "--rate", "100"]
    with subprocess.Popen(robofish, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
