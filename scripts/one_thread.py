"""One thread a process, for scripts that run several processes side by side."""

from __future__ import annotations

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "ROBOFISH_THREADS"), "1"
)
"""Environment of such a process, set before anything is imported that starts threads."""
