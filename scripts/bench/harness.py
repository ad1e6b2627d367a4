"""Measures contenders fairly: all in one run, in turn, several times over.

A machine that slows down for a moment then slows every contender alike, and a ratio of two
contenders is taken within each round before the median over the rounds.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

import numpy as np

PACKAGES = ("numpy", "numba", "gymnasium", "mujoco", "dm_control", "envpool", "rotorpy", "torch")

SETTLE_S = 0.02
"""Pause before each timing, in which threads of the one before fall asleep."""


@dataclass(frozen=True)
class Contender:
    """Something that steps environments.

    Attributes:
        name: what it is, as it stands in the table.
        envs: environments that one step advances.
        threads: threads that it may use.
        period_s: simulated seconds in one control step.
        substeps: physics steps in one control step.
        integrator: how a physics step is taken.
        run: takes that many steps of all environments, restarting those that end.
        environment: it gives observations and rewards, and restarts; False for a bare simulator.
    """

    name: str
    envs: int
    threads: int
    period_s: float
    substeps: int
    integrator: str
    run: Callable[[int], object] = field(repr=False)
    environment: bool = True


@dataclass(frozen=True)
class Missing:
    """A contender that could not be built, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Measured:
    """Environment steps per second of one contender in each round, shape (rounds,)."""

    contender: Contender
    rates: np.ndarray

    @property
    def median(self) -> float:
        """Median rate (environment steps/s)."""
        return float(np.median(self.rates))


@dataclass(frozen=True)
class Spread:
    """Median with the quartiles around it."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float] | np.ndarray) -> Spread:
        """Median and quartiles of some values."""
        low, median, high = np.percentile(values, [25, 50, 75])
        return cls(float(median), float(low), float(high))


def build(
    builders: Sequence[tuple[str, Callable[[], Contender]]],
) -> tuple[list[Contender], list[Missing]]:
    """Build every contender; one without its packages or enough memory is kept as missing."""
    ready, missing = [], []
    for name, builder in builders:
        try:
            ready.append(builder())
        except (ImportError, MemoryError) as error:
            missing.append(Missing(name, str(error)))
    return ready, missing


def steps_for(contender: Contender, seconds: float) -> int:
    """How many steps take about this long; warms the contender up on the way."""
    contender.run(1)
    steps = 1
    while True:
        started = time.perf_counter()
        contender.run(steps)
        taken = time.perf_counter() - started
        if taken > 0.2 * seconds:
            return max(1, round(steps * seconds / taken))
        steps *= 4


def measure(
    contenders: Sequence[Contender],
    rounds: int,
    seconds: float,
    report: Callable[[int], object] = lambda _: None,
) -> list[Measured]:
    """Run all contenders in turn, ``rounds`` times; every other round goes backwards.

    Args:
        contenders: who takes part.
        rounds: how often each is timed.
        seconds: about how long one timing takes.
        report: told the number of each round that begins.
    """
    steps = [steps_for(contender, seconds) for contender in contenders]
    rates = np.zeros((len(contenders), rounds))
    for turn in range(rounds):
        report(turn)
        order = range(len(contenders))
        for i in order if turn % 2 == 0 else reversed(order):
            time.sleep(SETTLE_S)
            started = time.perf_counter()
            contenders[i].run(steps[i])
            taken = time.perf_counter() - started
            rates[i, turn] = steps[i] * contenders[i].envs / taken
    return [Measured(c, rate) for c, rate in zip(contenders, rates, strict=True)]


def ratio(ours: Measured, theirs: Measured) -> Spread:
    """How many times faster, from the ratios within each round."""
    return Spread.of(ours.rates / theirs.rates)


def cpu_model() -> str:
    """Name of the processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"


def cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def load_average() -> list[float]:
    """Over 1, 5 and 15 minutes; empty where the system does not say (Windows)."""
    return [round(load, 2) for load in os.getloadavg()] if hasattr(os, "getloadavg") else []


def machine() -> dict[str, object]:
    """Where this ran: processor, cores this process may use, Python, load average now."""
    return {
        "cpu": cpu_model(),
        "cores": cores(),
        "system": platform.system(),
        "python": platform.python_version(),
        "load_average": load_average(),
    }


def versions(packages: Sequence[str] = PACKAGES) -> dict[str, str]:
    """Installed version of each package, or "not installed"."""
    found = {}
    for name in packages:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found
