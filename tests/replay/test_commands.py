"""`robofish replay`, and the replay that `simulate` and `compare` offer."""

import json
import re

import pytest

from fish_env.cli import main
from tests.fixtures.measured_data import good_folder, steady_folder

CASE = {
    "fish": "zheng-2021-a",
    "duration_s": 2.0,
    "schedule": [{"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 1.5}],
}


@pytest.fixture
def run(monkeypatch, tmp_path, capsys):
    """Runs `robofish` in a folder with a case; returns what it printed and its exit status."""
    (tmp_path / "case.json").write_text(json.dumps(CASE))
    monkeypatch.chdir(tmp_path)

    def robofish(*words):
        monkeypatch.setattr("sys.argv", ["robofish", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        shown = capsys.readouterr()
        return shown.out, " ".join(shown.err.split()), end.value.code

    return robofish


def page(file):
    """The data inside a page."""
    found = re.search(r'application/json"[^>]*>(.*?)</script>', file.read_text(), re.DOTALL)
    return json.loads(found.group(1))


def test_simulate_offers_a_page_and_still_prints_a_table(run, tmp_path):
    out, err, status = run("simulate", "case.json", "--replay", "swim.html")
    assert status == 0
    assert out.startswith("t,x,y,z")
    assert "replay: swim.html" in err
    (group,) = page(tmp_path / "swim.html")["groups"]
    assert [track["name"] for track in group["tracks"]] == ["case"]


def test_files_are_shown_together(run, tmp_path):
    for name in ("swim_measured.csv", "swim_baseline.csv"):
        assert run("simulate", "case.json", "--rate", "50", "--out", name)[2] == 0
    files = ("swim_measured.csv", "swim_baseline.csv")
    out, _, status = run("replay", *files, "--case", "case.json", "--out", "both.html")
    assert status == 0
    assert "both.html" in out
    (group,) = page(tmp_path / "both.html")["groups"]
    assert [track["role"] for track in group["tracks"]] == ["measured", "baseline"]
    assert "drawn as commanded" in group["tracks"][0]["notes"][0]


def test_a_run_of_a_dataset_is_drawn_with_its_own_fish(run, tmp_path):
    folder = good_folder(tmp_path / "data")
    assert run("replay", folder / "r01.csv")[2] == 0
    (group,) = page(tmp_path / "replay.html")["groups"]
    assert group["tracks"][0]["role"] == "measured"


def test_compare_shows_every_run_measured_beside_simulated(run, tmp_path):
    folder = good_folder(tmp_path / "data")
    assert run("compare", folder, "--replay", "runs.html")[2] == 0
    (group,) = page(tmp_path / "runs.html")["groups"]
    assert [track["name"] for track in group["tracks"]] == ["measured", "simulated"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("replay", "none.csv"), "no such file"),
        (("replay", "table"), "robofish compare table --replay"),
        (("replay", "case.json"), "reads .csv and .parquet"),
        (("compare", "table", "--replay", "a.html"), "no runs to replay"),
    ],
)
def test_what_cannot_be_replayed_is_one_line_and_status_two(run, tmp_path, words, said):
    steady_folder(tmp_path / "table")
    _, err, status = run(*words)
    assert status == 2
    assert err.startswith("robofish: ")
    assert said in err
    assert "Traceback" not in err
