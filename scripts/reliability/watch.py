"""What a long run must not use up: memory, open files, files left on the disk."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

MEGABYTE = 1_000_000
WARM_UP = 0.3
"""Share of the samples at the start that are not judged: caches fill, pools are made."""
GROWTH_MB_AN_HOUR = 8.0
"""Slope of memory above which it grows, once it is more than the noise of the samples."""
SPREAD_MB = 4.0
"""Memory that comes and goes between samples, as allocators keep pages."""


@dataclass(frozen=True)
class Sample:
    """What the process holds at a time.

    Attributes:
        time_s: since the start.
        memory_mb: resident memory.
        open_files: descriptors.
        threads: of the process.
        files: that lie in the watched folders.
    """

    time_s: float
    memory_mb: float
    open_files: int
    threads: int
    files: int


def sample(time_s: float, folders: Iterable[Path] = ()) -> Sample:
    """Look at this process (Linux) and at the folders it works in."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return Sample(
        round(time_s, 2),
        round(pages * os.sysconf("SC_PAGE_SIZE") / MEGABYTE, 2),
        len(os.listdir("/proc/self/fd")),
        len(os.listdir("/proc/self/task")),
        sum(1 for folder in folders for _ in folder.rglob("*")),
    )


def growth(samples: Sequence[Sample]) -> list[str]:
    """What grew after the warm-up, in words; empty if nothing did.

    Memory grows if a line through it rises by more than :data:`SPREAD_MB` over the samples and
    faster than :data:`GROWTH_MB_AN_HOUR`. Of what is counted, the least of the last third must not
    be above the most of the first third.
    """
    judged = list(samples[int(len(samples) * WARM_UP) :])
    if len(judged) < 3:
        return ["too few samples to tell"]
    found = []
    slope = slope_mb_an_hour(judged)
    rise = slope * (judged[-1].time_s - judged[0].time_s) / 3600.0
    if rise > SPREAD_MB and slope > GROWTH_MB_AN_HOUR:
        found.append(f"memory grows by {slope:.1f} MB an hour")
    third = max(1, len(judged) // 3)
    counted: dict[str, Callable[[Sample], int]] = {
        "open files": lambda s: s.open_files,
        "threads": lambda s: s.threads,
        "files left": lambda s: s.files,
    }
    for name, count in counted.items():
        before, after = max(map(count, judged[:third])), min(map(count, judged[-third:]))
        if after > before:
            found.append(f"{name}: {before} became {after}")
    return found


def slope_mb_an_hour(samples: Sequence[Sample]) -> float:
    """Slope of the resident memory (MB an hour) by least squares."""
    times = np.array([s.time_s for s in samples]) / 3600.0
    memory = np.array([s.memory_mb for s in samples])
    return float(np.polyfit(times - times[0], memory, 1)[0]) if np.ptp(times) > 0 else 0.0


def summary(samples: Sequence[Sample]) -> dict[str, Any]:
    """Samples in figures, for a result."""
    judged = list(samples[int(len(samples) * WARM_UP) :])
    return {
        "samples": len(samples),
        "first": asdict(samples[0]),
        "after_warm_up": asdict(judged[0]),
        "last": asdict(samples[-1]),
        "most_memory_mb": max(s.memory_mb for s in samples),
        "memory_mb_an_hour": round(slope_mb_an_hour(judged), 2),
        "grew": growth(samples),
    }
