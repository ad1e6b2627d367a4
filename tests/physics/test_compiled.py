"""Compiled and plain Python: the same source, the same numbers."""

import os
import subprocess
import sys

import numpy as np
import pytest

from fish_env.simulator import Simulator
from tests.broken import broken_simulator
from tests.physics.cases import ALL_EFFECTS, SWIM, TUMBLE, lopsided

CODE = """
import sys
import numpy as np
from fish_env.simulator import Simulator
from tests.physics.cases import ALL_EFFECTS, SWIM, TUMBLE, lopsided
effects = ALL_EFFECTS if sys.argv[1] == "effects" else None
run = Simulator(lopsided(), 0.01, effects).run(SWIM, duration_s=0.5, initial=TUMBLE)
print(" ".join(float(value).hex() for value in run.states[-1]))
"""


def compiled_end(effects) -> np.ndarray:
    run = Simulator(lopsided(), 0.01, effects).run(SWIM, duration_s=0.5, initial=TUMBLE)
    return run.states[-1]


@pytest.mark.parametrize("kind", ["baseline", "effects"])
def test_a_run_without_the_compiler_gives_the_same_numbers(kind, tmp_path):
    """NUMBA_DISABLE_JIT in a process of its own: what a debugger steps through is what runs."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "ROBOFISH_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", CODE, kind]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    plain = np.array([float.fromhex(word) for word in result.stdout.split()])
    np.testing.assert_allclose(
        plain, compiled_end(ALL_EFFECTS if kind == "effects" else None), rtol=0, atol=1e-12
    )


def test_the_unbroken_plain_model_gives_the_same_numbers():
    """The maker of broken models breaks nothing by itself."""
    simulator = broken_simulator({}, lopsided(), 0.01, ALL_EFFECTS)
    plain = simulator.run(SWIM, duration_s=0.5, initial=TUMBLE).states[-1]
    np.testing.assert_allclose(plain, compiled_end(ALL_EFFECTS), rtol=0, atol=1e-12)
