"""The list of the files that a diagnosis wrote, so that the next one removes these and no others.

The list stands in the folder of the diagnosis. A file goes only if its name is in the list and its
content is still what was written: what a user put there, or changed, stays.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from fish_env.files import write_text
from fish_env.reading import Unreadable, read_json
from fish_env.version import versioned

LIST = ".robofish-files.json"
"""Part of a diagnosis -> name of a file relative to the folder -> SHA-256 of its content."""
ENDINGS = (".svg", ".png", ".yaml", ".csv")


def replace_part(folder: Path, part: str, files: Iterable[Path]) -> None:
    """Removes what an earlier diagnosis wrote of a part and this one did not, and lists the rest.

    Args:
        folder: Folder of the diagnosis, with the list.
        part: Which part of it, such as its figures.
        files: What was just written of this part, all below the folder.
    """
    listed = _read(folder)
    now = {file.relative_to(folder).as_posix(): _digest(file) for file in files}
    for name, digest in listed.get(part, {}).items():
        file = folder / name
        if name not in now and _ours(name, folder, digest):
            file.unlink()
    listed[part] = now
    write_text(folder / LIST, json.dumps(versioned(listed), indent=1) + "\n")


def _read(folder: Path) -> dict[str, dict[str, str]]:
    """The list of an earlier diagnosis; what is not as it should be counts as not written."""
    try:
        found: Any = read_json(folder / LIST)
    except (OSError, Unreadable):
        return {}
    if not isinstance(found, Mapping):
        return {}
    return {part: dict(names) for part, names in found.items() if isinstance(names, Mapping)}


def _ours(name: str, folder: Path, digest: str) -> bool:
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or path.suffix not in ENDINGS or "\0" in name:
        return False
    file = folder / name
    linked = any((folder / above).is_symlink() for above in (path, *path.parents))
    return not linked and file.is_file() and _digest(file) == digest


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
