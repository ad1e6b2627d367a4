"""Versions agree and stand in what is written; the release checks notice what is wrong."""

import json
import os
import tomllib
from datetime import date
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from rich.console import Console

import fish_env
from fish_env.commands.numbers import write_json
from fish_env.data import load_dataset, write_dataset
from fish_env.data.schema import Dataset
from fish_env.params import load_fish
from fish_env.params.io import save_fish
from fish_env.plotting.style import drawing, save
from fish_env.replay import Group, motion_from_run, write_replay
from fish_env.simulator import Simulator
from fish_env.version import VERSION
from scripts import check_project, check_wheels

ROOT = Path(__file__).resolve().parents[2]


def test_one_version_is_named_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert project["version"] == fish_env.__version__ == VERSION == str(citation["version"])
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {VERSION} - {citation['date-released']}" in changes


def test_files_name_the_version_and_are_read_again(tmp_path):
    data = load_dataset("demo-trials")
    assert isinstance(data, Dataset)
    write_dataset(data, tmp_path / "data")
    save_fish(load_fish("zheng-2021-a"), tmp_path / "fish.yaml")
    fish = load_fish(tmp_path / "fish.yaml")
    write_replay([Group("a", (motion_from_run(data.runs[0]),))], fish, tmp_path / "a.html")
    write_json(Console(quiet=True), tmp_path / "numbers.json", {"a": 1})
    for name in ("data/dataset.yaml", "fish.yaml", "a.html"):
        assert f"robotic-fish {VERSION}" in (tmp_path / name).read_text(encoding="utf-8")
    assert json.loads((tmp_path / "numbers.json").read_text()) == {"version": VERSION, "a": 1}
    assert load_dataset(tmp_path / "data").name == data.name


def test_pictures_and_parquet_name_the_version(tmp_path):
    pd = pytest.importorskip("pandas")
    with drawing(1.0, 1.0) as figure:
        save(figure, tmp_path, "a", ("png", "svg", "pdf"))
    written = {ending: (tmp_path / f"a.{ending}").read_bytes() for ending in ("png", "svg")}
    assert all(f"robotic-fish {VERSION}".encode() in content for content in written.values())
    # Texts in a PDF may be in UTF-16.
    pdf = (tmp_path / "a.pdf").read_bytes().replace(b"\0", b"")
    assert f"robotic-fish {VERSION}".encode() in pdf
    swim = Simulator("zheng-2021-a").run([{"t": 0.0}], duration_s=0.1)
    swim.to_parquet(tmp_path / "a.parquet")
    kept = pd.read_parquet(tmp_path / "a.parquet")
    assert kept.attrs == {"written_by": f"robotic-fish {VERSION}"}


def test_a_table_of_motion_has_version_and_units_beside_it(tmp_path):
    swim = Simulator("zheng-2021-a").run([{"t": 0.0}], duration_s=0.1)
    swim.to_csv(tmp_path / "a.csv")
    described = json.loads((tmp_path / "a.csv-metadata.json").read_text())
    assert described["url"] == "a.csv"
    assert described["dc:creator"] == f"robotic-fish {VERSION}"
    columns = described["tableSchema"]["columns"]
    header = (tmp_path / "a.csv").read_text().splitlines()[0]
    assert [column["name"] for column in columns] == header.split(",")
    units = {column["name"]: column.get("schema:unitText") for column in columns}
    some = {"t": "s", "x": "m", "yaw": "rad", "r": "rad/s", "tail_frequency": "Hz", "qw": "1"}
    assert some.items() <= units.items()


def test_what_is_no_file_gets_no_description():
    swim = Simulator("zheng-2021-a").run([{"t": 0.0}], duration_s=0.1)
    swim.to_csv(os.devnull)
    assert not Path(f"{os.devnull}-metadata.json").exists()


def test_every_item_of_the_checklists_holds():
    assert {k: v for k, v in check_project.items(date(2026, 11, 22)).items() if v} == {}


def test_the_checklists_notice_what_is_wrong(tmp_path):
    def old(seed: int = 0) -> None: ...

    (tmp_path / "part").mkdir()
    (tmp_path / "part" / "a.py").write_text("import numpy as np\nnp.random.seed(0)\n")
    project = {"requires-python": ">=3.14", "dependencies": ["numpy<2.3"], "name": "x"}
    assert "SECURITY.md" in check_project.missing_files(tmp_path)
    assert "license" in check_project.missing_metadata(project)
    assert check_project.refused_versions(project, date(2026, 1, 1)) == [
        "Python 3.12",
        "Python 3.13",
        "numpy 2.3.0",
    ]
    assert check_project.loaded_early("pandas") == ["pandas"]
    assert check_project.global_random(("part",), tmp_path) == ["part/a.py:2"]
    assert check_project.without_rng([old]) == ["old"]


@pytest.mark.parametrize("change", ["content", "time"])
def test_wheels_that_differ_are_noticed(tmp_path, change):
    from zipfile import ZipInfo

    wheels = []
    for number in range(2):
        wheel = tmp_path / str(number) / "a.whl"
        wheel.parent.mkdir()
        with ZipFile(wheel, "w") as archive:
            time = (2020 + number * (change == "time"), 1, 1, 0, 0, 0)
            text = f"x = {number * (change == 'content')}"
            archive.writestr(ZipInfo("a.py", time), text)
        wheels.append(wheel)
    assert check_wheels.differences(*wheels) == (
        ["a.py"] if change == "content" else ["order, times or modes of the members"]
    )
    assert check_wheels.differences(wheels[0], wheels[0]) == []
