"""What cannot be written is refused before the work, not after it."""

import os
import stat
from pathlib import Path
from types import SimpleNamespace

import pytest

from fish_env.errors import OutputError
from fish_env.files import check_chosen, check_outputs
from tests.command_line import run
from tests.fixtures.measured_data import good_folder, steady_folder

WORK = (
    "fish_env.commands.compare._compare", "fish_env.commands.paper.run_study",
    "fish_env.commands.fit.fit_dataset", "robofish_agents.swimming.swim_episode",
    "fish_env.diagnosis.pipeline.diagnose_runs", "fish_env.diagnosis.pipeline.diagnose_steady",
)  # fmt: skip
COMMANDS = {
    "diagnose": "diagnose {0}/runs --out {0}/place/out",
    "diagnose steady": "diagnose {0}/steady --out {0}/place/out",
    "diagnose numbers": "diagnose {0}/runs --out {0}/free --json {0}/place/out/a.json",
    "compare": "compare {0}/runs --out {0}/place/out",
    "compare numbers": "compare {0}/runs --json {0}/place/out/a.json",
    "fit": "fit {0}/runs --trust-inputs --out {0}/place/out/a.yaml",
    "paper": "paper --out {0}/place/out",
    "plot": "plot all --out {0}/place/out",
    "swim": "swim --out {0}/place/out",
    "train": "train ppo-hold --out {0}/place/out",
    "evaluate": "evaluate --agent pid --suite calm --json {0}/place/out/a.json",
}


def read_only(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is mounted for reading alone: what the system says of a path on it."""
    place.mkdir()
    usual = os.statvfs

    def flags(path):
        below = str(path).startswith(str(place))
        return SimpleNamespace(f_flag=os.ST_RDONLY) if below else usual(path)

    monkeypatch.setattr(os, "statvfs", flags)


def forbidden(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place.mkdir()
    usual = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: not str(path).startswith(str(place)) and usual(path, mode)
    )


def taken(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place.write_text("of the user")


PLACES = {
    "Read-only file system": read_only,
    "Permission denied": forbidden,
    "Not a directory": taken,
}


@pytest.mark.parametrize("reason", PLACES)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_place_that_cannot_be_written_is_refused_at_once(
    command, reason, tmp_path, capsys, monkeypatch
):
    good_folder(tmp_path / "runs")
    steady_folder(tmp_path / "steady")
    for place in WORK:
        monkeypatch.setattr(place, None)
    monkeypatch.setattr("fish_env.commands.fit.check_runs", lambda measured: None)
    PLACES[reason](tmp_path / "place", monkeypatch)
    status, _, error = run(capsys, *COMMANDS[command].format(tmp_path).split())
    assert status == 2
    assert f"cannot be written ({reason})" in error
    assert f"{tmp_path / 'place'}" in error
    assert len(error.strip().splitlines()) == 1
    assert sorted(tmp_path.glob("*")) == [tmp_path / n for n in ("place", "runs", "steady")]
    assert not list(tmp_path.glob("place/*"))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
@pytest.mark.parametrize("mode", [0o500, 0o400, 0o000])
def test_a_folder_of_someone_else_is_refused(mode, tmp_path):
    folder = tmp_path / "theirs"
    folder.mkdir()
    folder.chmod(mode)
    try:
        with pytest.raises(OutputError, match=r"theirs.*\(Permission denied\)"):
            check_outputs([folder / "a" / "b.json"])
    finally:
        folder.chmod(0o700)


def test_a_folder_or_a_protected_file_in_the_place_is_refused(tmp_path, monkeypatch):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    for check in (check_outputs, check_chosen):
        with pytest.raises(OutputError, match=r"folder.*\(Is a directory\)|folder.*did not write"):
            check([tmp_path / "folder"])
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).is_dir())
    with pytest.raises(OutputError, match=r"file.*\(Permission denied\)"):
        check_outputs([tmp_path / "file"])


def test_names_that_no_disk_takes_are_refused(tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    for name in ("a" * 300, "loop", "loop/a", "a\0b"):
        with pytest.raises(OutputError, match="cannot be written"):
            check_outputs([tmp_path / name])


def test_what_can_be_written_passes_and_nothing_is_left(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("new")
    names = ("new-folder/deep/a.json", "pipe", "link", "b.json")
    check_outputs([tmp_path / name for name in names] + [Path("-"), Path("/dev/null"), Path("c")])
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "pipe"]
