"""Builds the wheel twice from clean copies and compares: `python -m scripts.check_wheels`.

Each copy holds the files under version control, as they are in the working tree, with other times
and in a folder of another name. So neither times nor places may stand in the wheel.
`--record` writes the digest into results/wheels-<date>.json.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from zipfile import ZipFile

from scripts.results import RESULTS, write_dated

ROOT = Path(__file__).resolve().parents[1]


def copy_of(source: Path, target: Path, time_s: float) -> None:
    """Copies what is under version control, and gives every file one time.

    Args:
        source: A working tree.
        target: A new folder.
        time_s: Seconds since 1970.
    """
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=source, capture_output=True, text=True, check=True
    )
    for name in filter(None, listed.stdout.split("\0")):
        if (source / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / name, target / name)
            os.utime(target / name, (time_s, time_s))


def build(tree: Path, out: Path) -> Path:
    """Builds a wheel with pip.

    Args:
        tree: What to build.
        out: Folder of the wheel.
    """
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-cache-dir"]
    subprocess.run([*pip, "--wheel-dir", str(out), str(tree)], check=True)
    [wheel] = out.glob("*.whl")
    return wheel


def differences(one: Path, other: Path) -> list[str]:
    """What differs between two wheels: members, or the order and the times in the archive.

    Args:
        one: A wheel.
        other: Another.
    """
    if one.name != other.name:
        return [f"names: {one.name}, {other.name}"]
    if one.read_bytes() == other.read_bytes():
        return []
    with ZipFile(one) as first, ZipFile(other) as second:
        names = sorted({*first.namelist(), *second.namelist()})
        held = [{n: z.read(n) for n in z.namelist()} for z in (first, second)]
    found = [name for name in names if held[0].get(name) != held[1].get(name)]
    return found or ["order, times or modes of the members"]


def main() -> int:
    """Builds twice, compares, and prints the digest."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--record", action="store_true", help="write a dated result")
    told = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="wheels-") as folder:
        wheels = []
        for name, time_s in (("first", 1_000_000_000.0), ("second-copy", 1_700_000_000.0)):
            tree = Path(folder) / name
            copy_of(ROOT, tree, time_s)
            wheels.append(build(tree, Path(folder) / f"{name}-wheel"))
        found = differences(*wheels)
        content = wheels[0].read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    if found:
        print("The wheels of two clean builds differ in:", *found, sep="\n  ")
    else:
        print(f"{wheels[0].name}: two clean builds give the same bytes, sha256 {digest}")
    if told.record:
        result = {
            "wheel": wheels[0].name, "same_bytes": not found, "differences": found,
            "bytes": len(content), "sha256": digest, "python": platform.python_version(),
        }  # fmt: skip
        print(write_dated(RESULTS, "wheels", result))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
