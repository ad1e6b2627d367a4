"""Files are put in place at once, or stay as they were, and outputs never replace inputs."""

import contextlib
import errno
import os
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fish_env import Simulator, load_fish
from fish_env.commands.simulate import write_table as write_motion
from fish_env.diagnosis.report.page import write_report
from fish_env.diagnosis.writing import write_answer
from fish_env.errors import OutputError, RoboticFishError
from fish_env.files import PART, check_outputs, replacing, write_bytes, write_text
from fish_env.params import save_fish
from fish_env.plotting.style import drawing, save
from fish_env.rendering import write_video
from fish_env.replay import write_replay
from robofish_agents.evaluation.results import write_results
from robofish_agents.policies import read_policy, shipped, write_policy
from tests.diagnosis.report_cases import answer
from tests.rendering.scenes import SETTING, scene

FISH = load_fish("zheng-2021-a")


def full(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def trajectory():
    row = {"t": 0.0, "tail_frequency": 1.0}
    return Simulator(FISH, 0.01).run([row], duration_s=0.2)


def picture(file: Path) -> None:
    with drawing(1, 1) as figure:
        save(figure, file.parent, file.stem, ("png",))


def film(file: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    write_video(file, [scene(time_s=0.1 * i) for i in range(3)], SETTING, size=(64, 48))


WRITERS: dict[str, Callable[[Path], object]] = {
    "bytes": lambda file: write_bytes(file, b"new"),
    "fish.yaml": lambda file: save_fish(FISH, file),
    "motion.csv": lambda file: trajectory().to_csv(file),
    "motion.parquet": lambda file: trajectory().to_parquet(file),
    "table.csv": lambda file: write_motion({"t": np.zeros(2)}, file),
    "table.parquet": lambda file: write_motion({"t": np.zeros(2)}, file),
    "page.html": lambda file: write_replay([], FISH, file),
    "results.json": lambda file: write_results(file, []),
    "policy.npz": lambda file: write_policy(read_policy(shipped("hold")[0]), file),
    "picture.png": picture,
    "film.mp4": film,
    "diagnosis.json": lambda file: write_answer({}, None, file.parent),
    "extended.yaml": lambda file: write_answer({}, FISH, file.parent),
    "report.html": lambda file: write_report(answer(), None, file.parent),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_names_the_file_and_leaves_what_was_there(name, tmp_path, monkeypatch):
    """Every writer of the package, where the disk is full at the last moment."""
    file = tmp_path / name
    file.write_bytes(b"of the user")

    def full_here(stream: int) -> None:
        part = Path(os.readlink(f"/proc/self/fd/{stream}"))
        if part.name.startswith(f".{file.stem}-"):
            full()

    monkeypatch.setattr(os, "fsync", full_here)
    with pytest.raises(OutputError, match=rf"{name}: cannot be written \(No space left") as caught:
        WRITERS[name](file)
    assert isinstance(caught.value, RoboticFishError)
    assert file.read_bytes() == b"of the user"
    assert not [path for path in tmp_path.rglob("*") if PART in path.name]


@pytest.mark.parametrize("name", WRITERS)
def test_every_writer_replaces_the_whole_file(name, tmp_path):
    file = tmp_path / name
    file.write_bytes(b"old")
    inode = file.stat().st_ino
    WRITERS[name](file)
    assert file.read_bytes() != b"old"
    assert file.stat().st_ino != inode
    assert not [path for path in tmp_path.rglob("*") if PART in path.name]


LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
from fish_env.files import write_text
write_text(sys.argv[1], "n" * 1_000_000)
"""


def test_a_write_that_the_system_cuts_off_leaves_the_old_file(tmp_path):
    """Not a stand-in: the system refuses to let a file grow beyond 2000 bytes."""
    file = tmp_path / "kept.txt"
    file.write_text("old")
    command = [sys.executable, "-c", LIMITED, str(file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "kept.txt: cannot be written (File too large); free some space" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["kept.txt"]
    assert file.read_text() == "old"


def test_an_interrupt_leaves_the_old_file(tmp_path):
    file = tmp_path / "kept.txt"
    file.write_text("old")
    with contextlib.suppress(KeyboardInterrupt), replacing(file) as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == ["kept.txt"]
    assert file.read_text() == "old"


def test_an_error_about_another_file_keeps_its_name(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"elsewhere\.csv"), replacing(tmp_path / "a") as _:
        (tmp_path / "elsewhere.csv").read_text()


def test_a_write_protected_file_stays(tmp_path, monkeypatch):
    """The folder would let it be replaced; its owner said that it must not be."""
    file = tmp_path / "kept.txt"
    file.write_text("old")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(OutputError, match="choose a place that you may write to"):
        write_text(file, "new")
    assert file.read_text() == "old"


@pytest.mark.parametrize("reason", [errno.EROFS, errno.EACCES])
def test_a_read_only_disk_names_the_file_and_leaves_it(reason, tmp_path, monkeypatch):
    file = tmp_path / "kept.txt"
    file.write_text("old")

    def refused(path: str, *_: object) -> int:
        raise OSError(reason, os.strerror(reason), str(path))

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", refused)
        with pytest.raises(OutputError, match=r"kept\.txt: cannot be written .*you may write to"):
            write_text(file, "new")
    assert file.read_text() == "old"


def test_standard_output_that_takes_nothing_is_named(tmp_path):
    """A full disk behind a redirection."""
    case = '{"fish": "zheng-2021-a", "duration_s": 0.1, "schedule": [{"t": 0.0}]}'
    (tmp_path / "case.json").write_text(case)
    command = [sys.executable, "-m", "fish_env.cli", "simulate", str(tmp_path / "case.json")]
    with Path("/dev/full").open("w") as full_disk:
        result = subprocess.run(
            command, stdout=full_disk, stderr=subprocess.PIPE, text=True, check=False
        )
    assert result.returncode == 2
    assert "standard output: cannot be written (No space left" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_place_that_cannot_be_is_refused(tmp_path):
    (tmp_path / "file").write_text("old")
    with pytest.raises(OutputError, match=r"file/below\.txt: cannot be written"):
        write_text(tmp_path / "file" / "below.txt", "new")
    with pytest.raises(OutputError, match="Is a directory"):
        write_text(tmp_path, "new")


def test_the_rights_of_a_file_stay_and_new_ones_are_as_usual(tmp_path):
    file, fresh, usual = (tmp_path / name for name in ("file", "fresh", "usual"))
    file.write_text("old")
    file.chmod(0o640)
    write_text(file, "new")
    write_text(fresh, "new")
    usual.write_text("as Python does")
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert fresh.stat().st_mode == usual.stat().st_mode


def test_the_file_behind_a_link_is_replaced_and_a_device_is_written_to(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("old")
    link.symlink_to(file)
    write_text(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"
    write_text("/dev/null", "nothing")
    assert not Path("/dev/null").is_file()


@pytest.mark.parametrize("name", ["a.csv", "soft.csv", "hard.csv", "below/../a.csv"])
def test_an_output_that_is_an_input_is_refused_under_any_name(name, tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "a.csv").write_text("t")
    (tmp_path / "soft.csv").symlink_to("a.csv")
    os.link(tmp_path / "a.csv", tmp_path / "hard.csv")
    with pytest.raises(OutputError, match=r"is read.*would be replaced"):
        check_outputs([tmp_path / name], [tmp_path / "a.csv"])


def test_other_outputs_pass_and_two_of_one_name_do_not(tmp_path):
    (tmp_path / "a.csv").write_text("t")
    (tmp_path / "b.csv").write_text("t")  # equal, but not the same
    check_outputs([tmp_path / "b.csv", None, tmp_path / "c"], [tmp_path / "a.csv", None])
    with pytest.raises(OutputError, match="two outputs"):
        check_outputs([tmp_path / "c", tmp_path / "below/../c"])
