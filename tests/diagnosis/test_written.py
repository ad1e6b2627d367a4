"""A diagnosis removes what an earlier one wrote into its folder, and nothing else."""

import json

import pytest

from fish_env.diagnosis.entries import FORMAT
from fish_env.diagnosis.report import write_report
from fish_env.diagnosis.writing import FIGURE, MARKS, check_own, write_answer
from fish_env.diagnosis.written import LIST
from fish_env.params import load_fish
from tests.diagnosis.report_cases import answer

FISH = load_fish("zheng-2021-a")


@pytest.fixture
def folder(tmp_path):
    """A folder with a diagnosis that has a ranking and an extended model."""
    write_answer({}, FISH, tmp_path)
    write_report(answer(), None, tmp_path)
    return tmp_path


def without(folder) -> None:
    """A later diagnosis, without ranking and extended model."""
    write_answer({}, None, folder)
    write_report(answer(ranking=[]), None, folder)


def test_what_an_earlier_diagnosis_wrote_goes(folder):
    assert (folder / "extended.yaml").exists()
    assert (folder / "figures" / "ranking.svg").exists()
    without(folder)
    assert not (folder / "extended.yaml").exists()
    assert not (folder / "figures" / "ranking.svg").exists()
    assert not (folder / "figures" / "ranking.png").exists()
    assert list((folder / "figures").glob("*.svg"))


def test_what_an_earlier_diagnosis_wrote_may_be_replaced(folder):
    write_answer({"format": FORMAT}, FISH, folder)
    (folder / "next_experiment.csv").write_text("t,tail_offset\n0,0\n")
    # A kill leaves unfinished files, and no list.
    (folder / "figures" / ".gain-0123.part.svg").write_text("")
    (folder / LIST).unlink()
    check_own(FISH, folder)
    (folder / "figures" / ".gain-0123.part.svg").unlink()
    assert {file.name for file in folder.glob("*.*")} >= set(MARKS)
    figures = [file.name for file in (folder / "figures").iterdir()]
    assert figures
    assert all(map(FIGURE.fullmatch, figures))


def test_what_a_user_put_there_stays(folder):
    mine = [folder / "figures" / "mine.svg", folder / "figures" / "photo.png", folder / "my.yaml"]
    for file in mine:
        file.write_text("of the user")
    without(folder)
    assert [file.read_text() for file in mine] == ["of the user"] * 3


def test_a_users_pictures_stay_at_the_first_diagnosis_too(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "mine.svg").write_text("of the user")
    (tmp_path / "extended.yaml").write_text("of the user")
    without(tmp_path)
    assert (tmp_path / "figures" / "mine.svg").read_text() == "of the user"
    assert (tmp_path / "extended.yaml").read_text() == "of the user"


def test_what_a_user_changed_stays(folder):
    (folder / "figures" / "ranking.svg").write_text("with arrows")
    (folder / "extended.yaml").write_text("name: corrected by hand")
    without(folder)
    assert (folder / "figures" / "ranking.svg").read_text() == "with arrows"
    assert (folder / "extended.yaml").read_text() == "name: corrected by hand"


@pytest.mark.parametrize("name", ["../mine.svg", "/mine.svg", "notes.txt", "figures/link.svg"])
def test_a_forged_list_removes_nothing_else(name, folder):
    """A folder may come from someone else, and its list with it."""
    out = folder / "out"
    without(out)
    listed = json.loads((out / LIST).read_text())
    (folder / "mine.svg").write_text("")
    (out / "notes.txt").write_text("")
    (out / "figures" / "link.svg").symlink_to(folder / "mine.svg")
    named = name if name[0] != "/" else str(folder / name[1:])
    empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    (out / LIST).write_text(json.dumps(listed | {"figures": {named: empty}}))
    without(out)
    assert (folder / "mine.svg").exists()
    assert (out / "notes.txt").exists()
    assert (out / "figures" / "link.svg").is_symlink()


@pytest.mark.parametrize("text", ["", "[]", '{"figures": 3}', '{"figures": {"a.svg": 3}}'])
def test_a_broken_list_counts_as_none(text, folder):
    (folder / LIST).write_text(text)
    without(folder)
    assert (folder / "figures" / "ranking.svg").exists()
    assert "figures" in json.loads((folder / LIST).read_text())
