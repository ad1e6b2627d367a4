"""The folder of compiled kernels, and numba's files in it, which heal themselves.

Numba's files are pickles, so the folder must be the user's own: whoever can write there can run
code. Each file carries a checksum; one that is cut short or damaged counts as absent, and what it
held is compiled anew. A disk that takes no files costs time, not results.
"""

from __future__ import annotations

import atexit
import hashlib
import io
import os
import re
import shutil
import stat
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

NAMED = "ROBOFISH_CACHE_DIR"
_OF_FUNCTION = re.compile(r"cannot cache function '[^']*': ")
"""How numba's reason begins."""
_DIGEST = hashlib.sha256().digest_size


def cache_root() -> Path:
    """Folder for compiled kernels: ``$ROBOFISH_CACHE_DIR``, else the user's cache folder.

    Where neither can be written, a private folder among the temporary ones.
    """
    named = os.environ.get(NAMED)
    if named:
        return Path(named)
    with suppress(RuntimeError):  # a user without a home
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
        root = Path(base) / "robofish"
        if _writable(root):
            return root
    return private_folder(Path(tempfile.gettempdir()))


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


@cache
def private_folder(among: Path) -> Path:
    """A folder that the user alone can read and write, among folders that anybody makes.

    One that stands there under the usual name is used only if it is the user's own, no link, and
    closed to others. Otherwise this process gets a fresh one, and the user is told.

    Args:
        among: Folder of temporary files.
    """
    folder = among / f"robofish-{_user()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700)
    fault = _fault(folder)
    if fault is None:
        return folder
    fresh = Path(tempfile.mkdtemp(prefix=f"robofish-{_user()}-", dir=among))
    atexit.register(_remove, fresh, os.getpid())
    warnings.warn(
        f"{folder}: {fault}, so compiled kernels in it are not trusted; this process compiles its "
        f"own. Remove that folder, or set {NAMED} to a folder of your own",
        stacklevel=2,
    )
    return fresh


def _user() -> str:
    """Tells users of a shared folder apart; on Windows that folder is each user's own."""
    return str(os.getuid()) if hasattr(os, "getuid") else "user"


def _fault(folder: Path) -> str | None:
    """Why a folder is not the user's private one; None if it is."""
    try:
        found = folder.lstat()
    except OSError as error:
        return f"cannot be made ({error.strerror})"
    if not stat.S_ISDIR(found.st_mode):
        return "is a link or a file, not a folder"
    if not hasattr(os, "getuid"):
        return None
    if found.st_uid != os.getuid():
        return "belongs to another user"
    if found.st_mode & 0o022:
        return "can be written by other users"
    if found.st_mode & 0o077:
        folder.chmod(0o700)
    return None


def _remove(folder: Path, process: int) -> None:
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def keep_machine_code(dispatcher: Any, folder: Path | None = None) -> None:
    """Keeps the machine code of a compiled function on disk, as numba's ``cache=True`` would.

    Args:
        dispatcher: What ``numba.njit`` returned; a plain function is left alone.
        folder: Where to keep it; None: beside the source.
    """
    if not hasattr(dispatcher, "enable_caching"):
        return
    try:
        dispatcher._cache = KernelCache(dispatcher.py_func, folder)
    except (OSError, RuntimeError) as error:
        # Told once, not for each function.
        _not_kept(_OF_FUNCTION.sub("", str(error)))


class KernelCache(FunctionCache):
    """Numba's cache of one function, which takes whatever goes wrong for an empty cache."""

    def __init__(self, py_func: Callable[..., Any], folder: Path | None) -> None:
        super().__init__(py_func)
        self._folder = folder
        if folder is not None:
            self._cache_path = str(folder)
        self._cache_file = CheckedFiles(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Machine code for a signature, or None if there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keeps machine code, if the disk takes it."""
        try:
            if self._folder is not None:
                self._folder.mkdir(parents=True, exist_ok=True)
            super().save_overload(sig, data)
        except OSError as error:
            _not_kept(f"{self._cache_path}: {error.strerror or error}")


class CheckedFiles(IndexDataCacheFile):
    """Numba's two kinds of cache files, each with the SHA-256 of its content at the end.

    Numba reads pickles, which end before the checksum.
    """

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        written = content.getvalue()
        with super()._open_for_write(filepath) as stream:
            stream.write(written + hashlib.sha256(written).digest())

    def _load_index(self) -> Any:
        return super()._load_index() if _intact(Path(self._index_path)) else {}

    def _load_data(self, name: str) -> Any:
        # Numba takes a missing data file for one to be compiled anew.
        if not _intact(Path(self._data_path(name))):
            raise FileNotFoundError(name)
        return super()._load_data(name)


def _intact(file: Path) -> bool:
    try:
        content = file.read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content[:-_DIGEST]).digest() == content[-_DIGEST:]


@cache
def _not_kept(reason: str) -> None:
    warnings.warn(
        f"compiled kernels cannot be kept ({reason}); every process compiles them anew. Set "
        f"{NAMED} to a folder with room that you may write to",
        stacklevel=2,
    )
