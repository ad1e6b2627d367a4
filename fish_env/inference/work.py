"""How much was simulated, and whether another search may begin.

Simulation steps are counted, and no time is taken: the same data then have the same answer on every
machine.
"""

from __future__ import annotations

from math import inf


class Work:
    """What an inference has simulated so far; all problems made from one share it.

    Args:
        size: simulation steps of all runs, one after another.
        most_passes: how often these are simulated before no further search begins.

    Attributes:
        cut_short: whether a search was asked for that may not begin.
    """

    def __init__(self, size: float = 1.0, most_passes: float = inf) -> None:
        self.size, self.most_passes = size, most_passes
        self.cut_short = False
        self._steps: list[int] = []  # threads append to it, which needs no lock

    def add(self, steps: int) -> None:
        """Count steps, those of each parameter vector."""
        self._steps.append(steps)

    @property
    def passes(self) -> float:
        """How often all runs have been simulated, each time with one parameter vector."""
        return sum(self._steps) / self.size

    def allows_more(self) -> bool:
        """Whether another search may begin; a refusal is remembered."""
        more = self.passes < self.most_passes
        self.cut_short |= not more
        return more
