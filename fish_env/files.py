"""Writing files: beside the old one and put in place at once, and never over what was read.

Every writer of the package uses :func:`replacing`, :func:`write_bytes` or :func:`write_text`. A
reader, a kill or a full disk then meets the old file or the new one, never a part of either.
"""

from __future__ import annotations

import csv
import errno
import io
import os
import stat
import sys
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from fish_env.errors import OutputError
from fish_env.version import PROGRAM

STANDARD = "-"
"""As an output of a command: standard output; as an input: standard input."""
PART = ".part"
"""Files that are being written have this in their names; a kill may leave one behind."""
FORBIDDEN = '/\\:*?"<>|'
"""What the names of files cannot hold on every system."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_LONGEST_STEM = 60
_MARKED, _MARKED_PDF = 2000, 100_000


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yields the path of a new file and puts that file in the place of `path` at the end.

    The new file stands in the same folder, with the same ending. If the block fails, it is removed
    and what was at `path` stays. Missing folders are made. Of a link, the file that it points to
    is replaced. A device or a pipe is written to as it is.

    Args:
        path: The file to write.

    Raises:
        OutputError: The file cannot be written; names it, the cause and what to do.
    """
    target, part = Path(os.path.realpath(path)), None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and not target.is_file() and not target.is_dir():
            yield target
            return
        part = _new_part(target)
        yield part
        _to_disk(part)
        part.replace(target)
        part = None
    except OSError as error:
        if isinstance(error, OutputError) or _of_another_file(error, target):
            raise
        raise cannot_write(path, error) from error
    finally:
        if part is not None:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def write_bytes(path: str | Path, content: bytes) -> None:
    """Writes a file at once, see :func:`replacing`; `-` is standard output.

    Args:
        path: The file to write.
        content: All of it.

    Raises:
        OutputError: The file cannot be written.
    """
    if str(path) == STANDARD:
        _to_standard_output(content)
        return
    with replacing(path) as part:
        part.write_bytes(content)


def _to_standard_output(content: bytes) -> None:
    try:
        sys.stdout.flush()
        stream = getattr(sys.stdout, "buffer", None)
        if stream is None:  # replaced by a stream of text, as notebooks do
            sys.stdout.write(content.decode("utf-8"))
        else:
            stream.write(content)
            stream.flush()
    except OSError as error:
        raise cannot_write("standard output", error) from error


def write_text(path: str | Path, text: str) -> None:
    """Writes a text in UTF-8 at once, see :func:`replacing`.

    Args:
        path: The file to write.
        text: All of it; line ends are written as they are.

    Raises:
        OutputError: The file cannot be written.
    """
    write_bytes(path, text.encode("utf-8"))


def write_rows(
    path: str | Path, names: Sequence[str], rows: Iterable[Mapping[str, Any]], missing: Any = ""
) -> None:
    """Writes a table as CSV at once, see :func:`replacing`.

    Args:
        path: The file to write.
        names: Columns, in their order.
        rows: Column -> value; no other columns than `names`.
        missing: What stands where a row has no value.

    Raises:
        OutputError: The file cannot be written.
    """
    text = io.StringIO()
    table = csv.DictWriter(text, names, restval=missing, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    write_text(path, text.getvalue())


def cannot_write(path: str | Path, error: OSError) -> OutputError:
    """Words the error for a file that cannot be written.

    Args:
        path: The file, or what else the user calls the output.
        error: What the system said.

    Returns:
        The error, to be raised by the caller.
    """
    if error.errno in _FULL:
        remedy = "free some space, or choose another place"
    elif error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
        remedy = "choose a place that you may write to"
    else:
        remedy = "choose another place"
    reason = error.strerror or str(error)
    return OutputError(
        f"{path}: cannot be written ({reason}); {remedy}. What was there is unchanged"
    )


def file_name(text: str) -> str:
    """Returns a text as part of a file name: what names cannot hold becomes an underscore."""
    allowed = "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in text)
    return allowed if allowed.strip(". ") else "_" * max(1, len(allowed))


def check_outputs(
    outputs: Iterable[str | Path | None], inputs: Iterable[str | Path | None] = ()
) -> None:
    """Refuses outputs that would replace a file that is read, or each other, or cannot be written.

    A command calls this before its work, which would be lost otherwise.

    Args:
        outputs: Files that will be written; None is passed over.
        inputs: Files that are read. One file under two names, or reached over a link, is one file.

    Raises:
        OutputError: Names the file.
    """
    read = [Path(path) for path in inputs if path is not None]
    written: list[Path] = []
    for output in (Path(path) for path in outputs if path is not None):
        for other in read if str(output) != STANDARD else ():
            if same_file(output, other):
                called = "" if output == other else f" (as {other})"
                raise OutputError(
                    f"{output}: is read{called} and would be replaced; give the output another name"
                )
        if any(same_file(output, other) for other in written):
            raise OutputError(f"{output}: two outputs have this name; give one another name")
        written.append(output)
        if str(output) != STANDARD:
            _check_place(output)


def _check_place(output: Path) -> None:
    """Refuses a file that cannot be written where it is to be; leaves nothing behind.

    Raises:
        OutputError: Names the file or its folder, and the cause.
    """
    kind = None
    try:
        target = Path(os.path.realpath(output))
        kind = target.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        pass
    except ValueError:
        raise cannot_write(ascii(str(output)), _error(errno.EINVAL)) from None
    except OSError as error:
        raise cannot_write(output, error) from None
    if kind is not None and stat.S_ISDIR(kind):
        raise cannot_write(output, _error(errno.EISDIR))
    if kind is not None and not stat.S_ISREG(kind):
        return  # a device or a pipe is written to as it is
    if kind is not None and not os.access(target, os.W_OK) and not _read_only(target):
        raise cannot_write(output, _error(errno.EACCES))
    folder = next(parent for parent in target.parents if os.path.exists(parent))
    named = output.parent if output.parent.name else output
    if not folder.is_dir():
        raise cannot_write(output, _error(errno.ENOTDIR))
    if _read_only(folder):
        raise cannot_write(named, _error(errno.EROFS))
    if not os.access(folder, os.W_OK | os.X_OK):
        raise cannot_write(named, _error(errno.EACCES))


def _read_only(path: Path) -> bool:
    """Whether a path lies on a disk that is mounted for reading alone."""
    return hasattr(os, "statvfs") and bool(os.statvfs(path).f_flag & os.ST_RDONLY)


def _error(number: int) -> OSError:
    return OSError(number, os.strerror(number))


def check_no_links(outputs: Iterable[Path]) -> None:
    """Refuses outputs whose names a program chose and that are links.

    A folder may come from someone else, with a link among its files to one of the user's.

    Args:
        outputs: Files that will be written.

    Raises:
        OutputError: Names the link.
    """
    link = next((output for output in outputs if output.is_symlink()), None)
    if link is not None:
        raise OutputError(
            f"{link}: is a link, and the file that it points to would be replaced; remove the "
            "link, or give another folder with --out"
        )


def check_first_line(output: Path, first: str) -> None:
    """Refuses to replace a file that begins otherwise than what will be written there.

    Args:
        output: The file, which need not be there.
        first: How its first line begins.

    Raises:
        OutputError: It is another file.
    """
    if output.exists() and _begin(output, len(first.encode())) != first.encode():
        raise _of_someone_else(output)


def check_mark(output: Path, mark: str, beside: Path | None = None) -> None:
    """Refuses to replace a file that does not hold, near an end, what this program writes.

    Args:
        output: The file, which need not be there.
        mark: Words within its first or last two kilobytes. Of a PDF file, the list of its objects,
            20 bytes each, stands behind them.
        beside: The file that holds them in its place, where it has no room for them.

    Raises:
        OutputError: It is another file.
    """
    marked = beside or output
    last = _MARKED_PDF if marked.suffix == ".pdf" else _MARKED
    if output.exists() and mark.encode() not in _begin(marked, _MARKED) + _end(marked, last):
        raise _of_someone_else(output)


def check_chosen(outputs: Iterable[Path], mark: str = PROGRAM) -> None:
    """Refuses outputs whose names a program chose: links, and files of someone else.

    Those that cannot be written are refused too.

    Args:
        outputs: Files that will be written, see :func:`check_no_links`.
        mark: What one of this program holds, see :func:`check_mark`.

    Raises:
        OutputError: Names the file.
    """
    files = list(outputs)
    check_no_links(files)
    for file in files:
        check_mark(file, mark)
        _check_place(file)


def named_or_chosen(given: Path | None, name: str) -> Path:
    """An output that the user named; else one in the working folder, with a name of the program's.

    Args:
        given: What the user named.
        name: What the program calls it.

    Raises:
        OutputError: The user named none, and a file of someone else has the program's name.
    """
    if given is not None:
        return given
    check_chosen([Path(name)])
    return Path(name)


def _begin(file: Path, count: int) -> bytes:
    """The first bytes of a file; none of what is no file or cannot be read."""
    if file.is_file():
        with suppress(OSError), file.open("rb") as stream:
            return stream.read(count)
    return b""


def _end(file: Path, count: int) -> bytes:
    """The last bytes of a file, as :func:`_begin` gives the first."""
    if file.is_file():
        with suppress(OSError), file.open("rb") as stream:
            stream.seek(max(0, file.stat().st_size - count))
            return stream.read(count)
    return b""


def _of_someone_else(output: Path) -> OutputError:
    return OutputError(
        f"{output}: this program did not write it and would replace it; move it away, or give "
        "another folder with --out"
    )


def same_file(one: Path, other: Path) -> bool:
    """Whether two paths are one file, also one that is not there yet.

    Args:
        one: A path.
        other: Another.
    """
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return os.path.realpath(one) == os.path.realpath(other)


def _new_part(target: Path) -> Path:
    """An empty file beside the target, with the rights that the target has or would get."""
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    exists = target.exists()
    if exists and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    stem = target.stem[:_LONGEST_STEM].lstrip(".")
    part = target.with_name(f".{stem}-{uuid.uuid4().hex[:12]}{PART}{target.suffix}")
    os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    if exists:
        with suppress(OSError):
            part.chmod(target.stat().st_mode & 0o777)
    return part


def _to_disk(part: Path) -> None:
    # Opened for writing: some systems refuse to flush what is open for reading.
    with part.open("rb+") as stream:
        os.fsync(stream.fileno())


def _of_another_file(error: OSError, target: Path) -> bool:
    """Whether an error tells of a file that is not the one being written, such as one read."""
    if not isinstance(error.filename, str):
        return False
    named = Path(error.filename)
    ours = named.parent == target.parent and PART in named.name
    return not ours and named != target and named not in target.parents
