"""Kills trainings, diagnoses, suites and sweeps over and over, and compares what comes of them.

    python -m scripts.reliability.crash               # 30 kills of each; one file each in results/
    python -m scripts.reliability.crash --only train --kills 5

Each work runs in a process of its own, which gets SIGKILL: at a random moment, or while a file is
being written. It is then started again in the same folder, until it ends by itself. What it leaves
must equal what a process leaves that nobody killed. A difference ends the rig with status 1.

A sweep trains in other processes, which Ray starts. At a random moment the process of the sweep
alone is killed; while one of the others is writing, all of them are killed, as by a power cut.
Campaigns are killed by ``make ray``.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

# Before anything is imported that makes threads: processes are forked from this one.
from scripts.one_thread import ONE_THREAD

os.environ.update(ONE_THREAD)

import numpy as np

from fish_env.files import PART
from scripts.bench import harness
from scripts.reliability.crash_works import WORKS, Work
from scripts.results import RESULTS, write_dated

MOMENTS = ("at a random moment", "while writing")
ERRORS = "errors.txt"
AFTER_EVENT_S = 0.004
"""A kill while writing comes so long after a new file was opened or put in place, at most."""
WRITES = "writes.txt"


@dataclass
class Score:
    """What became of the kills of one work.

    Attributes:
        kills: how many, by moment.
        ends: works that ended after kills and were compared.
        different: what was not as without kills, in words.
        parts: unfinished files that kills left behind.
        uninterrupted_s: how long the work takes if nobody kills it.
    """

    kills: dict[str, int] = field(default_factory=lambda: dict.fromkeys(MOMENTS, 0))
    ends: int = 0
    different: list[str] = field(default_factory=list)
    parts: int = 0
    uninterrupted_s: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """For a result."""
        return {"killed": sum(self.kills.values()), **vars(self)}


class Writes:
    """Counts what a process writes: each new file is opened, then renamed.

    Args:
        kill_at: after so many of these the process kills itself; None: never.
        delay_s: so long after the last of them, so that the kill falls into the writing too.
    """

    def __init__(self, kill_at: int | None = None, delay_s: float = 0.0) -> None:
        self.count, self.kill_at, self.delay_s = 0, kill_at, delay_s
        sys.addaudithook(self.notice)

    def notice(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Called by Python for each event."""
        if event not in ("open", "os.rename") or PART not in str(arguments[0]):
            return
        self.count += 1
        if self.count == self.kill_at:
            threading.Timer(self.delay_s, os.kill, (os.getpid(), signal.SIGKILL)).start()


def start(work: Work, folder: Path, kill_at: int | None = None, delay_s: float = 0.0) -> int:
    """Starts a work in a new process; errors go to a file beside the folder.

    Args:
        work: what to do.
        folder: where.
        kill_at: the process kills itself after so many openings and renamings; None: it does not.
        delay_s: so long after that.
    """
    folder.mkdir(parents=True, exist_ok=True)
    process = os.fork()
    if process:
        return process
    status = 1
    try:
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        writes = Writes(kill_at, delay_s)
        work.run(folder)
        folder.with_name(WRITES).write_text(str(writes.count), encoding="utf-8")
        status = 0
    except BaseException:
        folder.with_name(ERRORS).write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        os._exit(status)


def ended(process: int, block: bool) -> int | None:
    """Exit status of a process, negative for a signal; None if it still runs."""
    found, status = os.waitpid(process, 0 if block else os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if found else None


def parts_in(folder: Path) -> set[str]:
    """Files that are being written, or were when a kill came."""
    return {str(file) for file in folder.rglob(f".*{PART}*")}


def kill_at_random(work: Work, folder: Path, usual_s: float, rng: np.random.Generator) -> bool:
    """Starts a work and kills it within its usual time.

    Returns:
        Whether it was killed; False if it had ended by itself.

    Raises:
        RuntimeError: it failed by itself.
    """
    process = start(work, folder)
    until = time.monotonic() + rng.uniform(0.0, usual_s)
    while time.monotonic() < until:
        status = ended(process, block=False)
        if status is not None:
            _check(work, folder, status)
            return False
        time.sleep(0.001)
    os.kill(process, signal.SIGKILL)
    return _killed(work, folder, process)


def kill_all_while_writing(
    work: Work, folder: Path, usual_s: float, rng: np.random.Generator
) -> bool:
    """As :func:`kill_at_random`, for a work whose other processes write.

    After a random moment of the first three quarters of its usual time, the next unfinished file
    that is seen in the folder gets the work and all processes that it started killed.
    """
    process = start(work, folder)
    known, since = parts_in(folder), time.monotonic() + rng.uniform(0.0, 0.75 * usual_s)
    while True:
        status = ended(process, block=False)
        if status is not None:
            _check(work, folder, status)
            return False
        late = time.monotonic() >= since
        present = parts_in(folder) if late else set()
        if present - known:
            break
        time.sleep(0.0005 if late else 0.01)
    time.sleep(rng.uniform(0.0, AFTER_EVENT_S))
    for each in [*descendants(process), process]:
        with suppress(ProcessLookupError):
            os.kill(each, signal.SIGKILL)
    return _killed(work, folder, process)


def descendants(process: int) -> list[int]:
    """The processes that a process started, and those that these started, as Linux lists them."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    found, new = [], {process}
    while new:
        new = {child for child, parent in parents.items() if parent in new}
        found += sorted(new)
    return found


def kill_while_writing(work: Work, folder: Path, writes: int, rng: np.random.Generator) -> bool:
    """As :func:`kill_at_random`, for a kill after one of the openings and renamings of files."""
    # A work that goes on where it stopped writes less the next time.
    last = writes if work.begins_anew else writes // 2
    kill_at = int(rng.integers(1, max(2, last + 1)))
    return _killed(work, folder, start(work, folder, kill_at, rng.uniform(0.0, AFTER_EVENT_S)))


def _killed(work: Work, folder: Path, process: int) -> bool:
    status = ended(process, block=True)
    if status == -signal.SIGKILL:
        return True
    _check(work, folder, status)
    return False


def _check(work: Work, folder: Path, status: int | None) -> None:
    if status:
        file = folder.with_name(ERRORS)
        words = file.read_text(encoding="utf-8") if file.exists() else f"status {status}"
        raise RuntimeError(f"{work.name}: {words.strip()}")


def torment(
    work: Work, place: Path, kills: int, seed: int, most_minutes: float = math.inf
) -> Score:
    """Kills a work so many times, half of them while it writes, and compares each end.

    Args:
        work: what to kill.
        place: a folder of its own.
        kills: how many.
        seed: of the moments.
        most_minutes: after so long no further kill is begun.
    """
    rng, score = np.random.default_rng(seed), Score()
    begun = time.monotonic()
    _check(work, place / "whole", ended(start(work, place / "whole"), block=True))
    score.uninterrupted_s = round(time.monotonic() - begun, 2)
    writes = int((place / WRITES).read_text(encoding="utf-8"))
    wanted = work.outcome(place / "whole")
    attempts, late, usual_s = 0, begun + 60.0 * most_minutes, score.uninterrupted_s
    while sum(score.kills.values()) < kills and time.monotonic() < late:
        folder = place / f"killed-{score.ends}"
        while True:
            attempts += 1
            done = sum(score.kills.values())
            # Each folder gets some kills, so that many resumed ends are compared.
            enough = done >= kills or time.monotonic() > late
            if enough or attempts % (work.kills_each + 1) == 0:
                _check(work, folder, ended(start(work, folder), block=True))
                break
            moment, started = MOMENTS[done % 2], time.monotonic()
            fresh = work.begins_anew or not folder.exists()
            try:
                if moment == MOMENTS[0]:
                    killed = kill_at_random(work, folder, usual_s, rng)
                elif work.elsewhere:
                    killed = kill_all_while_writing(work, folder, usual_s, rng)
                else:
                    killed = kill_while_writing(work, folder, writes, rng)
                if not killed:
                    if fresh:  # the first time also reads and compiles
                        usual_s = min(usual_s, time.monotonic() - started)
                    break
            except RuntimeError as error:
                score.different.append(f"after {done} kills: {error}")
                return score
            score.kills[moment] += 1
            print(f"{work.name}: {done + 1} kills", file=sys.stderr, flush=True)
            score.different += work.damage(folder, place / "whole")
        score.parts += len(parts_in(folder))
        score.ends += 1
        found = work.outcome(folder)
        score.different += [
            f"folder {folder.name}: {name} differs"
            for name in sorted(wanted | found)
            if wanted.get(name) != found.get(name)
        ]
    return score


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.crash")
    add = parser.add_argument
    add("--only", help=f"some of {','.join(WORKS)}; default: all")
    add("--kills", type=int, default=30, help="of each work; default: 30")
    add("--most-minutes", type=float, default=math.inf, help="of each work, then fewer kills")
    add("--seed", type=int, default=0, help="of the moments")
    add("--out", type=Path, default=RESULTS, help="folder of the dated result")
    options = parser.parse_args(arguments)
    options.only = tuple((options.only or ",".join(WORKS)).split(","))
    if unknown := set(options.only) - set(WORKS):
        parser.error(f"--only: {', '.join(sorted(unknown))}: choose some of {', '.join(WORKS)}")
    return options


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    bad = []
    with tempfile.TemporaryDirectory() as place:
        for name in options.only:
            work = WORKS[name]()
            score = torment(
                work, Path(place) / name, options.kills, options.seed, options.most_minutes
            )
            if score.different:
                bad.append(name)
            about = {"work": name, "seed": options.seed, "machine": harness.machine()}
            about |= score.as_dict() | {"promise": work.promise}
            file = write_dated(options.out, f"crash-{name}", about)
            print(f"{name}: {score.as_dict()}; written: {file.name}", flush=True)
    print(f"{', '.join(bad) or 'nothing'} differs from the uninterrupted")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
