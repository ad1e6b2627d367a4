"""The CUDA back end on numba's simulator of CUDA, in a process of its own, without any GPU.

Numba reads the variable that turns the simulator on when it is imported.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fish_env.envs.options import env_options
from fish_env.errors import ConfigError
from fish_env.gpu.batch import DeviceBatch

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(path.name for path in Path(__file__).parent.glob("simulated_*.py"))


@pytest.mark.slow
def test_on_the_simulator():
    """In one process: half of the time of four would go into imports."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *(f"tests/gpu/{file}" for file in FILES)],
        cwd=ROOT,
        env=os.environ | {"NUMBA_ENABLE_CUDASIM": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_all_files_are_run():
    assert len(FILES) == 4


def test_without_a_gpu_the_user_is_told_what_to_do(monkeypatch):
    monkeypatch.setattr("numba.cuda.is_available", lambda: False)
    with pytest.raises(ConfigError, match="gpu"):
        DeviceBatch(env_options(), 2)
