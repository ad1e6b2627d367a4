"""An edit of a source that kernels draw on compiles them anew; an edit of any other does not."""

from __future__ import annotations

import inspect
import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fish_env.envs.batch import STEP_TEMPLATE
from fish_env.identification.filter_kernels import REPLAY_TEMPLATE, TEMPLATES
from fish_env.model import compose, jit
from fish_env.model.composition import TEMPLATE, Composition

ROOT = Path(__file__).resolve().parents[2]
DRAWN_ON = (
    "model/tail.py",
    "model/rollout_template.py",
    "effects/current.py",
    "params/packing.py",
    "envs/step_template.py",
    "envs/layout.py",
    "envs/rewards.py",
)
NOT_DRAWN_ON = ("envs/robotic_fish_3d.py", "envs/vector.py", "envs/batch.py", "envs/sb3.py")
EDITS = """
import json, sys
from pathlib import Path
from fish_env.envs.batch import STEP_TEMPLATE
from fish_env.model.compose import cache_folder
from fish_env.model.composition import TEMPLATE, Composition

package = Path(sys.modules["fish_env"].__file__).parent
environment = Composition(templates=(TEMPLATE, STEP_TEMPLATE))
folders = {}
for name in ["", *sys.argv[1:]]:
    file = package / name
    before = file.read_bytes() if name else b""
    if name:
        file.write_bytes(before + b"# edited")
    folders[name] = cache_folder(environment).name
    if name:
        file.write_bytes(before)
print(json.dumps(folders))
"""


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> dict[str, str]:
    """Cache folder of the environment's kernels after an edit of each file of a copy."""
    copy = tmp_path_factory.mktemp("copy")
    unneeded = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "fish_env", copy / "fish_env", ignore=unneeded)
    shutil.copytree(ROOT / "configs", copy / "configs")
    command = [sys.executable, "-c", EDITS, *DRAWN_ON, *NOT_DRAWN_ON]
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    result = subprocess.run(
        command, cwd=copy, env=environment, capture_output=True, text=True, check=True
    )
    return json.loads(result.stdout)


@pytest.mark.parametrize("file", DRAWN_ON)
def test_an_edit_of_a_source_starts_a_fresh_cache(folders, file):
    assert folders[file] != folders[""]


@pytest.mark.parametrize("file", NOT_DRAWN_ON)
def test_an_edit_of_any_other_file_compiles_nothing(folders, file):
    assert folders[file] == folders[""]


def files_of_code(namespace: dict[str, object]) -> set[Path]:
    """Files of the package whose functions a namespace holds, and theirs, to the last callee."""
    found: set[Path] = set()
    waiting = [namespace]
    while waiting:
        for value in waiting.pop().values():
            function = jit.py_function(value) if callable(value) else None
            if inspect.isfunction(function):
                file = Path(function.__code__.co_filename)
                if ROOT / "fish_env" in file.parents and file not in found:
                    found.add(file)
                    waiting.append(function.__globals__)
    return found


def hashed(composition: Composition) -> set[Path]:
    """Files that name the cache folder of a composition."""
    files = {path for folder in jit.PHYSICS for path in folder.glob("*.py")} | {jit.RECORD}
    return files.union(*(jit.sources_behind(template) for template in composition.templates))


@pytest.mark.parametrize(
    "templates",
    [(STEP_TEMPLATE,), TEMPLATES, (REPLAY_TEMPLATE,)],
    ids=["step", "filter", "replay"],
)
def test_whatever_a_composed_module_calls_is_hashed(templates):
    composition = replace(Composition(), templates=(TEMPLATE, *templates))
    called = files_of_code(vars(compose.load(composition)))
    assert len(called) > 10
    assert called <= hashed(composition)


def test_the_check_of_what_is_called_notices_a_file_that_is_not_hashed():
    composition = Composition(templates=(TEMPLATE, STEP_TEMPLATE))
    called = files_of_code(vars(compose.load(composition)))
    assert not called <= hashed(Composition())


@pytest.mark.parametrize(
    ("line", "file"),
    [
        ("from fish_env.envs.layout import GOAL", "envs/layout.py"),
        ("from fish_env.envs import layout", "envs/layout.py"),
        ("import fish_env.envs.layout", "envs/layout.py"),
        ("from fish_env.envs.tasks import TASKS", "envs/tasks/__init__.py"),
    ],
)
def test_every_way_to_import_is_noticed(tmp_path, line, file):
    template = tmp_path / "template.py"
    template.write_text(f"import numpy as np\n{line}\n")
    assert jit.PACKAGE / file in jit.sources_behind(template)
