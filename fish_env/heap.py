"""Memory of freed arrays, given back to the system."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

M_TRIM_THRESHOLD, M_TOP_PAD, M_MMAP_THRESHOLD = -1, -2, -3
"""Options of glibc's ``mallopt``, as <malloc.h> numbers them."""
LARGE = 2**16
"""Size of an array (bytes) from which on it has memory of its own: less than the residuals of a run
of half a minute take."""
SPARE = LARGE // 2
"""By how much more than needed the memory for small arrays grows (bytes): a large one that fitted
there would keep it from shrinking."""


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
    options = {M_MMAP_THRESHOLD: LARGE, M_TRIM_THRESHOLD: LARGE, M_TOP_PAD: SPARE}
    return all(mallopt(option, size) for option, size in options.items())
