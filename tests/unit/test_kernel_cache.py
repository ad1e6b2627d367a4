"""Compiled kernels: in a folder of the user's own alone, and healed where they are damaged."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import stat
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from fish_env.model import kernel_cache
from fish_env.model.kernel_cache import cache_root, private_folder

USE = """
import json, sys
from pathlib import Path
import numpy as np
from fish_env.model import jit

calls = []

@jit.entry_point
def double(x):
    return 2.0 * x

print(json.dumps([double(3.0), sum(double.stats.cache_hits.values())]))
"""


@pytest.fixture(autouse=True)
def _fresh():
    private_folder.cache_clear()
    kernel_cache._not_kept.cache_clear()
    yield
    private_folder.cache_clear()


def without_home(monkeypatch, among: Path) -> None:
    """A user whose cache folder cannot be written."""
    monkeypatch.delenv(kernel_cache.NAMED, raising=False)
    monkeypatch.setattr(kernel_cache, "_writable", lambda folder: False)
    monkeypatch.setattr(kernel_cache.tempfile, "gettempdir", lambda: str(among))


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_the_fallback_is_made_private_and_used_again(tmp_path, monkeypatch):
    without_home(monkeypatch, tmp_path)
    folder = cache_root()
    assert folder == tmp_path / f"robofish-{os.getuid()}"
    assert mode(folder) == 0o700
    private_folder.cache_clear()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cache_root() == folder


def as_link(folder: Path) -> None:
    (folder.parent / "elsewhere").mkdir()
    folder.symlink_to(folder.parent / "elsewhere")


def as_open_folder(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (as_link, "is a link"),
        (as_open_folder, "can be written by other users"),
        (Path.touch, "is a link or a file"),
    ],
)
def test_a_fallback_that_others_could_fill_is_not_used(make, said, tmp_path, monkeypatch):
    """What it holds would be run; a fresh folder heals, and the user is told."""
    without_home(monkeypatch, tmp_path)
    planted = tmp_path / f"robofish-{os.getuid()}"
    make(planted)
    with pytest.warns(UserWarning, match=said) as told:
        folder = cache_root()
    assert str(planted) in str(told[0].message)
    assert "ROBOFISH_CACHE_DIR" in str(told[0].message)
    assert folder != planted
    assert folder.parent == tmp_path
    assert not folder.is_symlink()
    assert mode(folder) == 0o700
    assert cache_root() == folder


def test_a_fallback_of_another_user_is_not_used(tmp_path, monkeypatch):
    without_home(monkeypatch, tmp_path)
    (tmp_path / "robofish-77").mkdir(mode=0o700)
    monkeypatch.setattr(kernel_cache.os, "getuid", lambda: 77)
    with pytest.warns(UserWarning, match="belongs to another user"):
        assert cache_root() != tmp_path / "robofish-77"


def test_a_fallback_that_others_can_only_read_is_closed(tmp_path, monkeypatch):
    without_home(monkeypatch, tmp_path)
    folder = tmp_path / f"robofish-{os.getuid()}"
    folder.mkdir(mode=0o755)
    assert cache_root() == folder
    assert mode(folder) == 0o700


def test_a_fresh_folder_goes_with_its_process(tmp_path):
    (tmp_path / f"robofish-{os.getuid()}").touch()
    code = (
        "import sys, warnings; from pathlib import Path\n"
        "from fish_env.model.kernel_cache import private_folder\n"
        "warnings.simplefilter('ignore'); print(private_folder(Path(sys.argv[1])))"
    )
    command = [sys.executable, "-c", code, str(tmp_path)]
    made = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert Path(made).parent == tmp_path
    assert not Path(made).exists()


class Kernel:
    """A module with one kernel, used in processes of its own."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "kernel.py"
        if not self.file.exists():
            self.file.write_text(USE)

    def use(self, **environment: str) -> tuple[list[float], str]:
        """Result and cache hits of a process, and what it said."""
        result = subprocess.run(
            [sys.executable, str(self.file)],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout), result.stderr

    def files(self, ending: str) -> list[Path]:
        return sorted((self.file.parent / "__pycache__").glob(f"*.{ending}"))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """The folder of a module whose kernel was compiled and kept."""
    made = Kernel(tmp_path_factory.mktemp("compiled"))
    assert made.use()[0] == [6.0, 0]
    return made.file.parent


@pytest.fixture
def kernel(compiled, tmp_path):
    """A copy of it, which tests may damage."""
    shutil.copytree(compiled, tmp_path, dirs_exist_ok=True)
    return Kernel(tmp_path)


def test_what_was_compiled_is_kept(kernel):
    assert kernel.use()[0] == [6.0, 1]


def shortened(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [lambda content: b"", shortened, flipped, lambda c: c[:-1]])
def test_a_damaged_cache_heals_itself(ending, damage, kernel):
    """Index and data, cut short at any place or with a wrong byte: compiled anew, then kept."""
    (file,) = kernel.files(ending)
    file.write_bytes(damage(file.read_bytes()))
    assert kernel.use()[0] == [6.0, 0]
    assert kernel.use()[0] == [6.0, 1]


def test_a_pickle_without_its_checksum_is_not_loaded(kernel, tmp_path):
    """So a file that was left by another program, or by an earlier version, is not run."""
    mark = tmp_path / "mark"
    for file in (*kernel.files("nbi"), *kernel.files("nbc")):
        file.write_bytes(pickle.dumps(Trap(str(mark))))
    assert kernel.use()[0] == [6.0, 0]
    assert not mark.exists()


class Trap:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self):
        return os.mkdir, (self.path,)


FULL = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
"""


def test_a_disk_that_takes_no_files_costs_time_only(tmp_path):
    made = Kernel(tmp_path)
    made.file.write_text(FULL + USE)
    for _ in range(2):
        numbers, said = made.use()
        assert numbers == [6.0, 0]
        assert "compiled kernels cannot be kept" in said
        assert "ROBOFISH_CACHE_DIR" in said


COMPOSED = """
from fish_env.model import compose
from fish_env.model.composition import Composition
print(compose.load(Composition()).__file__)
"""


def composed(folder: Path, prelude: str = "") -> tuple[Path, str]:
    """File of the baseline's module, as a process of its own loads it, and what that said."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    result = subprocess.run(
        [sys.executable, "-c", prelude + COMPOSED],
        env={**kept, "ROBOFISH_CACHE_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return Path(result.stdout.strip()), result.stderr


@pytest.mark.parametrize("damage", [lambda content: b"", shortened])
@pytest.mark.parametrize("ending", [".py", ".pyc"])
def test_a_damaged_composed_source_heals_itself(ending, damage, tmp_path):
    file, _ = composed(tmp_path)
    whole = file.read_bytes()
    hurt = file if ending == ".py" else next((file.parent / "__pycache__").glob("*.pyc"))
    hurt.write_bytes(damage(hurt.read_bytes()))
    assert composed(tmp_path)[0] == file
    assert file.read_bytes() == whole


def test_a_composed_source_that_was_changed_is_not_run(tmp_path):
    file, _ = composed(tmp_path)
    file.write_text(f"open({str(tmp_path / 'mark')!r}, 'w')\n" + file.read_text())
    composed(tmp_path)
    assert not (tmp_path / "mark").exists()


def test_a_composed_source_that_cannot_be_kept_is_loaded_all_the_same(tmp_path):
    file, said = composed(tmp_path, FULL)
    assert not file.exists()
    assert "cannot be written" in said
    # Once, not for each of its functions.
    assert said.count("compiled kernels cannot be kept") == 1
