"""A run of a million rows is read, and imported, in bounded time and memory."""

import json
import subprocess
import sys

import pytest

from tests.fixtures.measured_data import RUN, good_folder

ROWS = 1_000_000
LONGEST_S = 120.0
"""Processor time. Reading takes some ten seconds, importing twice that."""
MOST_MB = 2000.0
READ = """
import json, resource, sys, time
sys.path.insert(0, ".")
from fish_env.data import load_dataset
from fish_env.data.importing import open_logs
begun = time.process_time()
if sys.argv[1].endswith(".csv"):
    (source,), _ = open_logs([sys.argv[1]])
    rows = len(source)
else:
    rows = len(load_dataset(sys.argv[1]).runs[0].time_s)
used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
print(json.dumps([rows, time.process_time() - begun, used]))
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", [".", "r01.csv"], ids=["dataset", "import"])
def test_a_million_rows_are_read(name, tmp_path):
    header, first, *_ = RUN.splitlines()
    cells = first.partition(",")[2]
    text = "".join(f"{0.001 * i:.3f},{cells}\n" for i in range(ROWS))
    folder = good_folder(tmp_path, run=f"{header}\n{text}")
    command = [sys.executable, "-c", READ, str(folder / name)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows, taken, megabytes = json.loads(done.stdout)
    assert rows == ROWS
    assert taken < LONGEST_S
    assert megabytes < MOST_MB
