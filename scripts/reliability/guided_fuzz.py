"""Coverage-guided fuzzing of the readers, with Atheris (libFuzzer).

    python -m scripts.reliability.guided_fuzz --seconds 600              # each reader so long
    python -m scripts.reliability.guided_fuzz --reader fish --seconds 60

Inputs that reach new lines are kept in out/fuzz/<reader> and tried first the next time. An input
that gives anything but an answer or one line of refusal is written beside them as `crash-...` and
ends the run with status 1: add it to tests/fuzzing/found_inputs.py. Atheris and not HypoFuzz: it
needs no test runner, its mutations work on the bytes of a file, and it has a wheel for Python 3.11.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path

from scripts.results import ROOT, write_dated

CORPUS = ROOT / "out" / "fuzz"
SEEDS = {
    "fish": "configs/fish/*.yaml",
    "files of a fish": "configs/fish/*.yaml",
    "environment": "configs/env/*.yaml",
    "suite": "configs/benchmarks/*.yaml",
    "training": "configs/train/*.yaml",
    "case": "examples/**/*.json",
    "results": "agents/robofish_agents/evaluation/*.json",
    "policy": "agents/robofish_agents/pretrained/**/*.npz",
}
"""Files that the first inputs of a reader are made from."""
TRIED = re.compile(r"stat::number_of_executed_units:\s*(\d+)")
LONGEST_INPUT = 4096


def fuzz_here(reader: str, seconds: int) -> None:
    """Fuzzes one reader in this process, which libFuzzer ends."""
    import atheris

    with atheris.instrument_imports(include=["fish_env", "robofish_agents"]):
        from tests.fuzzing.readers import READERS, fault

    warnings.simplefilter("ignore")
    read, suffix = READERS[reader]
    corpus = CORPUS / reader.replace(" ", "-")
    corpus.mkdir(parents=True, exist_ok=True)
    for i, file in enumerate(sorted(ROOT.glob(SEEDS.get(reader, "none")))):
        (corpus / f"seed-{i}").write_bytes(file.read_bytes())
    place = tempfile.TemporaryDirectory()
    file = Path(place.name) / f"input{suffix}"

    def try_one(content: bytes) -> None:
        file.write_bytes(content)
        fault(read, file)

    atheris.Setup(
        [
            "guided_fuzz", str(corpus), f"-max_total_time={seconds}", "-print_final_stats=1",
            f"-artifact_prefix={corpus}/", "-timeout=10", f"-max_len={LONGEST_INPUT}",
            "-rss_limit_mb=4096",
        ],
        try_one,
    )  # fmt: skip
    atheris.Fuzz()


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m scripts.reliability.guided_fuzz")
    parser.add_argument("--reader", help="one reader; default: all in turn")
    parser.add_argument("--seconds", type=int, default=60, help="for each reader")
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help="folder of a dated result")
    options = parser.parse_args(arguments)
    if options.here:
        fuzz_here(options.reader, options.seconds)
        return
    from tests.fuzzing.readers import READERS

    tried: dict[str, int | str] = {}
    for reader in [options.reader] if options.reader else READERS:
        command = [sys.executable, "-m", "scripts.reliability.guided_fuzz", "--here"]
        command += ["--reader", reader, "--seconds", str(options.seconds)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, errors="replace")
        count = TRIED.search(done.stderr)
        good = done.returncode == 0 and count is not None
        tried[reader] = int(count[1]) if good and count else done.stderr.strip()[-1500:]
        print(f"{reader}: {tried[reader]}", flush=True)
    if options.out:
        write_dated(options.out, "guided-fuzz", {"seconds": options.seconds, "tried": tried})
    sys.exit(any(isinstance(found, str) for found in tried.values()))


if __name__ == "__main__":
    main()
