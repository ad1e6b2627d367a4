"""The crash rig, shortened: killed works go on to the same result; those that do not are noticed.

Each rig runs in a process of its own: it forks, which a process with threads should not.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CARELESS = """
import json, sys, time
from pathlib import Path
from scripts.reliability import crash
from scripts.reliability.crash_works import Work

class Counting(Work):
    name, promise = "count", "the count"

    def run(self, folder):
        file = folder / "count.json"
        resumed = file.exists()
        count = json.loads(file.read_text()) if resumed else 0
        while count < 30:
            count += {step}
            {write}
            time.sleep(0.002)

    def outcome(self, folder):
        return {{"count": json.loads((folder / "count.json").read_text())}}

score = crash.torment(Counting(), Path(sys.argv[1]), 8, 0)
print(json.dumps(score.as_dict()))
"""
IN_PLACE = """
            with file.open("w") as stream:
                for digit in json.dumps(count).rjust(9):
                    stream.write(digit); stream.flush(); time.sleep(0.001)"""
AT_ONCE = "from fish_env.files import write_text; write_text(file, json.dumps(count))"


def count(place, write, step=1):
    code = CARELESS.format(write=write.strip() if "\n" in write else write, step=step)
    done = subprocess.run(
        [sys.executable, "-c", code, str(place)], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_work_that_writes_at_once_survives(tmp_path):
    score = count(tmp_path, AT_ONCE)
    assert score["killed"] == 8
    assert score["kills"]["while writing"] > 0
    assert score["different"] == []


def test_a_work_that_writes_in_place_is_found_out(tmp_path):
    assert count(tmp_path, IN_PLACE)["different"]


def test_a_work_that_goes_on_otherwise_is_found_out(tmp_path):
    """It counts in other steps once it was killed."""
    assert count(tmp_path, AT_ONCE, "(7 if resumed else 1)")["different"]


@pytest.mark.slow
@pytest.mark.parametrize("work", ["train", "suite", "sweep"])
def test_two_kills(work, tmp_path):
    command = [sys.executable, "-m", "scripts.reliability.crash", "--only", work]
    done = subprocess.run(
        [*command, "--kills", "2", "--out", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = tmp_path.glob("crash-*.json")
    score = json.loads(file.read_text())
    assert score["killed"] == 2
    assert score["ends"] >= 1
    assert score["different"] == []
