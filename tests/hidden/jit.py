"""How the hidden suite compiles its own physics, and where the machine code is kept.

numba's cache does not see an edit in another file, so the folder is named by all sources here.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import numba

HERE = Path(__file__).parent


def source_hash() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for file in sorted(HERE.glob("*.py")):
        text = file.read_bytes()
        if b"tests.hidden.jit import" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """`$ROBOFISH_CACHE_DIR`, else the user's cache folder, else a temporary one."""
    named = os.environ.get("ROBOFISH_CACHE_DIR")
    root = Path(named) if named else Path.home() / ".cache" / "robofish"
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError:
        root = Path(tempfile.mkdtemp(prefix="robofish-"))  # of this user alone
    return root / f"hidden-{source_hash()}"


def helper(function):
    """Compiles a function that only compiled functions call: Python must not, it has no way in."""
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(error_model="numpy", **options)(function)


def entry_point(function):
    """Compiles a function that Python calls, and keeps its machine code on disk."""
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(cache_folder())
    try:
        return numba.njit(error_model="numpy", nogil=True, cache=True)(function)
    finally:
        numba.config.CACHE_DIR = before
