"""Files whose names a command chooses replace its own files, and none of the user's."""

from pathlib import Path

import numpy as np
import pytest

from fish_env.analysis.results import CompareResult, DiagnoseResult
from fish_env.comparison import compare
from fish_env.data import load_dataset
from fish_env.errors import OutputError
from fish_env.files import check_chosen
from fish_env.params import load_fish, save_fish
from fish_env.params.io import check_tables
from fish_env.plotting.comparison import draw_runs, picture_files
from tests.command_line import run
from tests.fixtures.measured_data import good_folder, steady_folder

TABLE = "alpha_deg,C\n0,0.1\n30,0.5\n60,0.9\n90,1.1\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Data, and a fish with a table."""
    (tmp_path / "mine.yaml").write_text(
        "base: zheng-2021-a\nname: mine\ntail: {drag: {table: drag.csv}}\n"
    )
    (tmp_path / "drag.csv").write_text(TABLE)
    good_folder(tmp_path / "runs", fish="../mine.yaml")
    steady_folder(tmp_path / "steady", fish="../mine.yaml")
    (tmp_path / "path.csv").write_text("north,east,depth\n0,0,0.4\n0.1,0,0.4\n")
    (tmp_path / "out").mkdir()
    return tmp_path


REFUSED = {
    "run_r01.png": "compare {0}/runs --out {0}/out",
    "agreement.png": "compare {0}/steady --out {0}/out",
    "agreement.pdf": "compare {0}/steady --out {0}/out",
    "over_commands.png": "compare {0}/steady --out {0}/out",
    "path.png": "swim --path {0}/path.csv --out {0}/out",
    "tracking.png": "swim --out {0}/out",
    "actuators.png": "swim --out {0}/out",
    "rectilinear_speed.pdf": "paper --out {0}/out",
    "spiral_path.png": "paper --out {0}/out",
    "statements.md": "paper --out {0}/out",
    "mine.tail.drag.csv": "fit {0}/runs --trust-inputs --out {0}/out/mine.yaml",
    "extended.tail.drag.csv": "diagnose {0}/runs --out {0}/out",
    "identified.yaml": "fit {0}/runs --trust-inputs",
    "replay.html": "replay {0}/runs/r01.csv",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_of_the_user_is_kept(name, folder, capsys, monkeypatch):
    """It is so before anything is computed or written."""
    monkeypatch.chdir(folder / "out")
    for place in (
        "fish_env.commands.compare._compare", "fish_env.commands.paper.run_study",
        "fish_env.commands.fit.fit_dataset", "robofish_agents.swimming.swim_episode",
        "fish_env.diagnosis.pipeline.diagnose_runs",
    ):  # fmt: skip
        monkeypatch.setattr(place, None)
    monkeypatch.setattr("fish_env.commands.fit.check_runs", lambda measured: None)
    file = folder / "out" / name
    for text in ("of the user", TABLE.replace("deg", "rad")):
        file.write_text(text)
        status, _, error = run(capsys, *REFUSED[name].format(folder).split())
        assert status == 2
        assert f"{name}: this program did not write it" in " ".join(error.split())
        assert file.read_text() == text
        assert [file.name for file in (folder / "out").iterdir()] == [name]


def test_swim_replaces_no_path_by_its_numbers(folder, capsys):
    words = ["--path", str(folder / "path.csv"), "--json", str(folder / "path.csv")]
    status, _, error = run(capsys, "swim", "--out", str(folder / "out"), *words)
    assert status == 2
    assert "is read" in error


@pytest.mark.parametrize("command", ["compare {0}/runs", "compare {0}/steady"])
def test_a_second_run_replaces_its_pictures(command, folder, capsys):
    words = [*command.format(folder).split(), "--out", str(folder / "out")]
    assert run(capsys, *words)[0] == 0
    before = {file.name for file in (folder / "out").iterdir()}
    assert run(capsys, *words)[0] == 0
    assert {file.name for file in (folder / "out").iterdir()} == before != set()


def test_all_pictures_of_a_comparison_are_known(folder):
    data = load_dataset(folder / "runs")
    comparison = compare(data)
    draw_runs(comparison, folder / "out")
    drawn = sorted((folder / "out").iterdir())
    assert sorted(picture_files(data, folder / "out")) == drawn
    assert sorted(picture_files(comparison, folder / "out")) == drawn


def test_pictures_from_python_replace_no_file_of_the_user(folder):
    comparison = compare(load_dataset(folder / "runs"))
    file = picture_files(comparison, folder / "out")[0]
    file.write_text("of the user")
    with pytest.raises(OutputError, match="did not write it"):
        CompareResult(comparison).plot(folder / "out")
    assert file.read_text() == "of the user"


def test_a_diagnosis_saved_from_python_replaces_no_table_of_the_user(folder, tmp_path):
    kept, mine = tmp_path / "kept", folder / "out" / "extended.tail.drag.csv"
    save_fish(load_fish(folder / "mine.yaml"), kept / "extended.yaml")
    mine.write_text("of the user")
    with pytest.raises(OutputError, match="did not write it"):
        DiagnoseResult({}, kept).save(folder / "out")
    assert [mine.read_text()] == [file.read_text() for file in (folder / "out").iterdir()]
    mine.unlink()
    for _ in range(2):  # the second replaces its own
        DiagnoseResult({}, kept).save(folder / "out")
    assert load_fish(folder / "out" / "extended.yaml").tail == load_fish(folder / "mine.yaml").tail


def test_a_fish_replaces_its_own_tables(folder):
    fish, file = load_fish(folder / "mine.yaml"), folder / "out" / "new.yaml"
    for _ in range(2):
        check_tables(fish, file)
        save_fish(fish, file)
    (folder / "out" / "new.tail.drag.csv").unlink()
    (folder / "out" / "new.tail.drag.csv").symlink_to(folder / "drag.csv")
    with pytest.raises(OutputError, match="is a link"):
        check_tables(fish, file)


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_a_large_picture_names_the_program(ending, tmp_path):
    """The end of a PDF file is a list of its objects, which may be long."""
    from fish_env.plotting.style import drawing, save

    with drawing(2, 2) as figure:
        axes = figure.subplots()
        for place in range(200):
            axes.plot(np.arange(2.0), np.arange(2.0) + place, "o", ms=1.0 + place / 100)
        save(figure, tmp_path, "large", (ending,))
    check_chosen([tmp_path / f"large.{ending}"])
