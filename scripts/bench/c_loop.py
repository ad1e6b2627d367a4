"""How far the compiled physics is from a plain C loop of the same arithmetic.

    python -m scripts.bench.c_loop

Compiles ``c_loop/fish_loop.c`` with gcc for this machine, checks that it swims the same
trajectories, and times both in turn on one core: one fish, and 1024 fish with parameters of their
own. ``strict`` keeps IEEE rounding, as the package does; ``fast`` is -ffast-math, the best case.
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fish_env import load_fish
from fish_env.effects.extended import build_model
from scripts.bench import harness
from scripts.bench.harness import Contender
from scripts.bench.ours import drawn_commands, schedule_grid, start_state
from scripts.bench.report import short

SOURCE = Path(__file__).with_name("c_loop") / "fish_loop.c"
PLAIN = ("-O3", "-march=native", "-shared", "-fPIC", "-ffp-contract=off")
# Without these two gcc leaves every loop with a square root or a choice in it scalar.
STRICT = (*PLAIN, "-fno-math-errno", "-fno-trapping-math", "-mprefer-vector-width=512")
FAST = (*PLAIN[:-1], "-ffast-math", "-mprefer-vector-width=512")
DT = 0.01
SUBSTEPS = 10
TOLERANCE = 1e-10

Loop = Callable[[np.ndarray, int], None]


@dataclass(frozen=True)
class Case:
    """Fish to advance: states (18, N), held commands (5, N), records (49, N)."""

    state: np.ndarray
    commands: np.ndarray
    record: np.ndarray

    @classmethod
    def of(cls, count: int) -> Case:
        """Fish that differ in drag, mass and command."""
        model = build_model(load_fish("zheng-2021-a"))
        spread = 1.0 + 0.1 * np.random.default_rng(3).uniform(-1, 1, (2, count))
        record = model.records(
            {
                "body.plane_xy.drag.c0": 0.16 * spread[0],
                "inertia.rest[2]": 0.0083 * spread[1],
            }
        )
        return cls(start_state(count), drawn_commands((1, count))[0], record)


def compile_loop(flags: tuple[str, ...], lanes: int, folder: Path) -> ctypes.CDLL:
    """Build the C loop for blocks of ``lanes`` fish.

    Raises:
        FileNotFoundError: there is no gcc.
    """
    gcc = shutil.which("gcc")
    if gcc is None:
        raise FileNotFoundError("gcc is needed to compile the C loop")
    library = folder / f"fish_{abs(hash(flags))}_{lanes}.so"
    command = [gcc, *flags, f"-DLANES={lanes}", "-o", str(library), str(SOURCE), "-lm"]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(library))
    loaded.advance.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_long] * 2 + [ctypes.c_double]
    loaded.advance.restype = None
    return loaded


def c_advance(library: ctypes.CDLL, case: Case) -> Loop:
    """The C loop as a function of the states, which it advances in place."""
    inputs, record = case.commands.ctypes.data, case.record.ctypes.data

    def advance(state: np.ndarray, steps: int) -> None:
        library.advance(state.ctypes.data, inputs, record, state.shape[1], steps, DT)

    return advance


def our_advance(case: Case) -> Loop:
    """The package's kernel on the same fish, on one thread."""
    model = build_model(load_fish("zheng-2021-a"))
    kernels, count = model.kernels, case.state.shape[1]
    inputs, clock = case.commands.copy(), np.zeros(count)
    slew, failed_at = np.full((5, count), np.inf), np.full(count, np.inf)
    commands = case.commands[None].copy()

    def advance(state: np.ndarray, steps: int) -> None:
        kernels.advance(
            state, inputs, case.record, slew, clock, commands, schedule_grid(0, 1, steps, DT),
            tables=model.tables, failed_at=failed_at, threads=1,
        )  # fmt: skip

    return advance


def disagreement(first: Loop, second: Loop, case: Case, steps: int = 200) -> float:
    """Largest difference of any state after some steps, each state relative to one."""
    states = [case.state.copy(), case.state.copy()]
    for advance, state in zip((first, second), states, strict=True):
        advance(state, steps)
    scale = np.maximum(1.0, np.abs(states[0]))
    return float(np.max(np.abs(states[0] - states[1]) / scale))


def contender(name: str, advance: Loop, case: Case, steps: int) -> Contender:
    """Something to time: calls of ``steps`` physics steps for all fish, from the same start."""
    count = case.state.shape[1]

    def run(calls: int) -> None:
        state = case.state.copy()
        for _ in range(calls):
            advance(state, steps)

    return Contender(name, count, 1, steps * DT, steps, "RK4", run, environment=False)


def compare(count: int, steps: int, folder: Path, rounds: int, seconds: float) -> list[str]:
    """Rows of the table for one number of fish.

    Raises:
        AssertionError: the loops do not swim the same trajectories.
    """
    case = Case.of(count)
    ours = our_advance(case)
    lanes = 1 if count == 1 else 16
    contenders = [contender("ours", ours, case, steps)]
    for name, flags in (("C, strict", STRICT), ("C, fast", FAST)):
        theirs = c_advance(compile_loop(flags, lanes, folder), case)
        difference = disagreement(ours, theirs, case)
        assert difference < TOLERANCE, f"{name}, {count} fish: trajectories differ, {difference}"
        contenders.append(contender(f"{name} (differs by {difference:.0e})", theirs, case, steps))
    measured = harness.measure(contenders, rounds, seconds)
    rows = []
    for m in measured:
        by = harness.ratio(m, measured[0])
        each = 1e9 / (m.median * steps)
        rows.append(
            f"| {count} | {m.contender.name} | {short(m.median * steps)} | {each:.0f} ns "
            f"| {by.median:.2f} ({by.low:.2f} to {by.high:.2f}) |"
        )
    return rows


def main(argv: list[str] | None = None) -> None:
    """Compile, check, time, print."""
    parser = argparse.ArgumentParser(prog="python -m scripts.bench.c_loop")
    parser.add_argument("--quick", action="store_true", help="short timings")
    quick = parser.parse_args(argv).quick
    rounds, seconds = (5, 0.05) if quick else (25, 0.2)
    print(f"{harness.machine()}\n")
    print("| fish | loop | physics steps/s | each | times ours |")
    print("| --: | --- | --: | --: | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for count, steps in ((1, 1000), (1024, SUBSTEPS)):
            try:
                rows = compare(count, steps, Path(folder), rounds, seconds)
            except FileNotFoundError as error:
                sys.exit(str(error))
            print("\n".join(rows))


if __name__ == "__main__":
    main()
