"""A lock, so that one training at a time uses a folder."""

from __future__ import annotations

import json
import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from fish_env.errors import ConfigError
from fish_env.files import cannot_write

try:
    import fcntl
except ImportError:  # Windows; there two trainings in one folder are not told apart
    fcntl = None  # type: ignore[assignment]

LOCK = "training.lock"
MOST_BYTES = 1000


class Held(ConfigError):
    """Raised when another training runs in a folder."""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Locks a folder for this process; the system releases it however the process ends.

    A file in the folder is locked and names the process. It is removed at the end. A file that a
    killed process left is not locked.

    Args:
        folder: made if missing.

    Raises:
        Held: another training runs in the folder; says in which process.
        OutputError: the folder cannot be written.
    """
    if fcntl is None:
        yield
        return
    file = folder / LOCK
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = _held(file)
    except OSError as error:
        raise cannot_write(file, error) from error
    if held is None:
        raise Held(
            f"{folder}: {_holder(file)} trains here now; wait until it ends, stop it, or give "
            "another folder with --out"
        )
    try:
        yield
    finally:
        with suppress(OSError):
            file.unlink()  # while it is locked, so that nobody else's file is removed
        os.close(held)


def _held(file: Path) -> int | None:
    """The locked file, opened; None if another process holds it."""
    while True:
        # A folder may come from someone else, with a link to a file of the user's by this name.
        opened = os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        try:
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _check_ours(file, opened)
            # Its last holder may have removed it between the two calls above.
            current = _is(opened, file)
        except BlockingIOError:
            os.close(opened)
            return None
        except (OSError, ConfigError):
            os.close(opened)
            raise
        if current:
            break
        os.close(opened)
    about = {
        "process": os.getpid(),
        "host": socket.gethostname(),
        "since": datetime.now().astimezone().isoformat(timespec="seconds"),
    }
    os.ftruncate(opened, 0)
    os.write(opened, json.dumps(about).encode())
    return opened


def _check_ours(file: Path, opened: int) -> None:
    """Refuses a file that no lock is: it would be emptied.

    Raises:
        ConfigError: it holds something else, or has a second name.
    """
    about = os.fstat(opened)
    content = os.pread(opened, MOST_BYTES + 1, 0) if stat.S_ISREG(about.st_mode) else b"?"
    ours = not content or (content.startswith(b'{"process"') and len(content) <= MOST_BYTES)
    if about.st_nlink > 1 or not ours:
        raise ConfigError(
            f"{file}: is no lock of a training; move it away, or give another folder with --out"
        )


def _is(opened: int, file: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(opened), file.stat())
    except FileNotFoundError:
        return False


def _holder(file: Path) -> str:
    with suppress(OSError, ValueError, KeyError, TypeError):
        about: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return f"process {about['process']} on {about['host']}, since {about['since']},"
    return "another process"
