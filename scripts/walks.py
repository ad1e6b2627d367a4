"""Walks from raw log to answer, as the pages describe them: `python -m scripts.walks`.

Each walk makes raw logs of a simulated robot, runs the commands of a page as they stand there in an
empty folder, and checks how it ends. `--install` first sets up a virtual environment from this
folder for the walks, with the extras that the pages name; without it, the running one is used. A
fresh kernel cache is used with `--cold`. Times and ends go into results/walks-<date>.json.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from scripts.bench.harness import machine
from scripts.results import RESULTS, ROOT, write_dated
from scripts.walk_logs import write_bags, write_csv, write_mat

EXTRAS = "train,logs,notebook"


class WalkError(Exception):
    """A command failed, or a walk did not end as its page says."""


@dataclass(frozen=True)
class Walk:
    """One way from a log to an answer.

    Attributes:
        page: Page with the commands, from the root.
        blocks: Their names on the page, in order.
        make: Writes the raw logs into a folder.
        between: What a person does after each block.
        end: Returns what the walk ended with; raises WalkError where that is wrong.
    """

    page: str
    blocks: tuple[str, ...]
    make: Callable[[Path], None]
    end: Callable[[Path], str]
    between: Callable[[Path], None] = lambda folder: None


def commands(page: str, block: str) -> str:
    """The lines of a block that follows `<!-- walk: BLOCK -->` on a page.

    Raises:
        WalkError: The page has no such block.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.search(rf"<!-- walk: {re.escape(block)} -->\n```[^\n]*\n(.*?)```", text, re.DOTALL)
    if found is None:
        raise WalkError(f"{page}: no block after <!-- walk: {block} -->")
    return found[1]


def verdict(folder: Path) -> str:
    """The verdict, which must be the servo's lag."""
    answer = json.loads((folder / "out/trials/diagnosis.json").read_text(encoding="utf-8"))
    named = f"{answer['verdict']}: {', '.join(cause['name'] for cause in answer['causes'])}"
    if named != "cause: servo_lag":
        raise WalkError(f"the diagnosis ends with {named!r} instead of 'cause: servo_lag'")
    return named


def policy(folder: Path) -> str:
    """The trained policy with its success on the evaluations of the training."""
    files = sorted(folder.glob("out/**/policy.npz"))
    if not files:
        raise WalkError("no policy.npz was written")
    return f"policy: {files[0].relative_to(folder)}"


def notebook(folder: Path) -> str:
    """A verdict and a policy, which `jupyter execute` writes beside the notebook."""
    beside = folder / "examples"
    return f"{verdict(beside)}; {policy(beside)}"


def correct(folder: Path) -> None:
    """Writes the line that the verdict `inputs` names into dataset.yaml, as the page asks."""
    answer = json.loads((folder / "out/trials/diagnosis.json").read_text(encoding="utf-8"))
    if answer["verdict"] != "inputs":
        raise WalkError(f"the flipped servo ends with {answer['verdict']!r} instead of 'inputs'")
    file = folder / "trials/dataset.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    for fault in answer["inputs"]:
        if fault["decisive"]:
            for section, entries in yaml.safe_load(fault["fix"]).items():
                for name, changes in entries.items():
                    old = content[section][name]
                    content[section][name] = {**(old if isinstance(old, dict) else {}), **changes}
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


def copy_notebook(folder: Path) -> None:
    """The notebook of the examples."""
    (folder / "examples").mkdir()
    shutil.copy(ROOT / "examples/log-to-policy.ipynb", folder / "examples")


WALKS: Mapping[str, Walk] = {
    "csv": Walk("docs/import.md", ("csv",), write_csv, verdict),
    "ros2": Walk("docs/import.md", ("ros2", "ros2 again"), write_bags, verdict, correct),
    "mat": Walk("docs/import.md", ("mat",), write_mat, verdict),
    "notebook": Walk("docs/notebook.md", ("notebook",), copy_notebook, notebook),
    "rl": Walk("docs/learning.md", ("rl",), lambda folder: None, policy),
}


def walk(name: str, folder: Path, programs: Path, cache: Path | None) -> dict[str, Any]:
    """Goes one walk.

    Args:
        name: Of the walk.
        folder: Empty folder to work in.
        programs: Folder with `robofish` and `jupyter`.
        cache: Folder of compiled kernels; None for the user's own.

    Returns:
        Page, seconds of each block and the end.

    Raises:
        WalkError: A command failed, or the end is wrong.
    """
    plan, seconds = WALKS[name], []
    plan.make(folder)
    env = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    env.pop("PYTHONPATH", None)  # the installed package, not this folder
    env |= {} if cache is None else {"ROBOFISH_CACHE_DIR": str(cache)}
    for i, block in enumerate(plan.blocks):
        if i:
            plan.between(folder)
        begun = time.monotonic()
        done = subprocess.run(
            ["bash", "-e", "-o", "pipefail", "-c", commands(plan.page, block)],
            cwd=folder, env=env, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            raise WalkError(f"{name}: exit status {done.returncode}\n{done.stdout}{done.stderr}")
        seconds.append(round(time.monotonic() - begun, 1))
    return {"page": plan.page, "seconds": seconds, "end": plan.end(folder)}


def install(folder: Path) -> tuple[Path, float]:
    """Sets up a virtual environment with the package; returns its programs and the seconds."""
    begun = time.monotonic()
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    pip = [str(folder / "bin/python"), "-m", "pip", "install", "--quiet"]
    constraints = ["--constraint", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, *constraints, f"{ROOT}[{EXTRAS}]"], check=True)
    return folder / "bin", round(time.monotonic() - begun, 1)


def main() -> None:
    """Goes the walks and writes what they took."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("walks", nargs="*", default=list(WALKS), help="names; all without any")
    parser.add_argument(
        "--install", action="store_true", help="in a virtual environment of its own"
    )
    parser.add_argument("--programs", type=Path, default=Path(sys.executable).parent)
    parser.add_argument("--cold", action="store_true", help="with an empty kernel cache")
    parser.add_argument("--out", type=Path, default=RESULTS)
    told = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="walks-") as name:
        top, content = Path(name), dict[str, Any]()
        programs, cache = told.programs.absolute(), top / "cache" if told.cold else None
        if told.install:
            programs, content["install_s"] = install(top / "venv")
        content |= {"machine": machine(), "cold": told.cold, "walks": {}}
        for each in told.walks:
            folder = top / each
            folder.mkdir()
            content["walks"][each] = walk(each, folder, programs, cache)
            print(f"{each}: {content['walks'][each]}", flush=True)
    print(write_dated(told.out, "walks", content))


if __name__ == "__main__":
    main()
