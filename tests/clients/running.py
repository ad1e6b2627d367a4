"""What the tests of clients share: the environment's name, and programs run as a user would."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENV = "fish_env:RoboticFish3D-v0"
ONE_THREAD = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "CUDA_VISIBLE_DEVICES": ""}


def run(folder: Path, *arguments: str, python: str = sys.executable) -> str:
    """Runs Python in a folder and returns what it printed; fails with all of it."""
    done = subprocess.run(
        [python, *map(str, arguments)], cwd=folder, env={**os.environ, **ONE_THREAD}, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    return done.stdout
