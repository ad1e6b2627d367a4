"""How many lanes the processor computes at once."""

from __future__ import annotations

from llvmlite.binding import get_host_cpu_features


def lanes_at_once() -> int:
    """Lanes in a vector register of 64-bit numbers: 8 with AVX-512, else 4.

    What a loop has over whole vectors is computed lane by lane, and the rest of a vector then takes
    longer than all of it. With AVX2 that is not so, and 8 lanes take half as long again as 4.
    """
    return 8 if get_host_cpu_features().get("avx512f", False) else 4
