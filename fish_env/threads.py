"""How many threads to use."""

from __future__ import annotations

import os


def default_threads() -> int:
    """Threads for batches: ``$ROBOFISH_THREADS``, else the cores this process may use."""
    named = os.environ.get("ROBOFISH_THREADS")
    return max(1, int(named)) if named else _cores()


def _cores() -> int:
    """Cores this process may use; all of them where the system does not say (macOS, Windows)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
