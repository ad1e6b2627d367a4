"""Memory of freed arrays, given back to the system."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Options of glibc's ``mallopt``, as <malloc.h> numbers them."""
LARGE = 2**20
"""Size of an array (bytes) from which on it has memory of its own."""


@cache
def give_back_large_arrays() -> bool:
    """Tell the C library, once for a process, to give back large arrays when they are freed.

    glibc keeps freed blocks of up to 32 MiB for later, in each thread's own arena. A diagnosis
    frees many such arrays in several threads, and its process would grow far beyond what it uses.

    Returns:
        Whether there is such a C library.
    """
    if not sys.platform.startswith("linux"):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, LARGE)) and bool(mallopt(M_TRIM_THRESHOLD, LARGE))
