"""The command line as a whole: help, errors, and each command's words."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from fish_env.cli import app
from fish_env.effects import catalogue
from fish_env.params import load_fish
from tests.command_line import run

COMMANDS = sorted(get_command(app).commands)  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = run(capsys, command, "--help")
    assert status == 0
    assert f"robofish {command}" in out.split("Example")[1]


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "nowhere.json"),
        ("info", "--fish", "zheng"),
        ("compare", "no-such-dataset"),
        ("compare", "msu-steady", "--fish", "no-such-fish"),
    ],
)
def test_an_error_is_one_line_and_status_two(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, err = run(capsys, *arguments)
    assert status == 2
    assert err.startswith("robofish: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err


def test_a_folder_that_cannot_be_written_is_no_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    target = str(tmp_path / "file" / "numbers.json")
    status, _, err = run(capsys, "compare", "msu-steady", "--json", target)
    assert status == 2
    last = err.splitlines()[-1]  # others may tell of kernels that are compiled
    assert last.startswith(f"robofish: {target}: cannot be written")
    assert "Traceback" not in err


def test_a_warning_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = tmp_path / "case.json"
    rows = [{"t": 0, "block_displacement": -0.02}]
    case.write_text(json.dumps({"fish": "zheng-2021-b", "duration_s": 0.1, "schedule": rows}))
    status, _, err = run(capsys, "simulate", str(case), "--dt", "0.01")
    assert status == 0
    assert err.startswith("robofish: zheng-2021-b: block displacement")
    assert err.count("\n") == 1


def test_importing_the_command_line_is_light() -> None:
    code = "import sys, fish_env.cli; print(*sorted(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"matplotlib", "pandas", "torch", "scipy.spatial", "scipy.stats"}
    assert not heavy & set(loaded)


def test_effects_lists_every_effect_with_its_parameters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _, out, _ = run(capsys, "effects")
    for effect in catalogue().values():
        assert effect.name in out
        for parameter in effect.parameters:
            assert parameter.name in out


def test_info_shows_every_parameter_and_its_sources(capsys: pytest.CaptureFixture[str]) -> None:
    fish = load_fish("msu-tail-fish")
    _, out, _ = run(capsys, "info", "--fish", "msu-tail-fish")
    flat = " ".join(out.split())
    for path in fish.values():
        assert path.partition(".")[2] in out
        assert fish.info(path).source in flat
    for words in ("righting moment", "static margin, yaw", "crank reaches", "Speed in m/s"):
        assert words in flat


def test_info_names_the_effects_in_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "lagging.yaml"
    file.write_text(
        "name: lagging\nbase: zheng-2021-a\neffects: {servo_lag: {time_constant: 0.05}}\n"
    )
    _, out, _ = run(capsys, "info", "--fish", str(file))
    assert "servo_lag: time_constant 0.05" in out


def test_compare_writes_json_and_pictures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "numbers.json"
    status, out, _ = run(
        capsys, "compare", "msu-steady", "--json", str(target), "--out", str(tmp_path)
    )
    assert status == 0
    numbers = json.loads(target.read_text())
    assert numbers["kind"] == "steady"
    assert len(numbers["observations"]["yaw_rate"]["simulated"]) == 29
    assert "Largest error in" in " ".join(out.split())
    assert (tmp_path / "agreement.png").is_file()
    assert (tmp_path / "over_commands.pdf").is_file()


def test_the_demonstration_names_the_pictures_it_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rich.console import Console

    from fish_env.commands.demo import compare_with_a_real_fish

    pictures = compare_with_a_real_fish(Console(), tmp_path)
    assert pictures
    assert all(picture.is_file() for picture in pictures)
    assert "yaw rate: simulated" in capsys.readouterr().out
