"""CleanRL's PPO, the script of its last release as it is.

CleanRL 1.2.0 was written for Gymnasium below 1.0, so it runs in an environment of its own, whose
interpreter CLEANRL_PYTHON names; `make clients` makes it. SAC of that release imports `gym` 0.23,
where no environment of Gymnasium is registered.
"""

import os
import re

import pytest

from tests.clients.running import ENV, run

PLACE = "import importlib.util as u; print(u.find_spec('cleanrl').submodule_search_locations[0])"
STEPS, ROLLOUT = 4096, 512


def test_cleanrls_ppo_trains(tmp_path):
    python = os.environ.get("CLEANRL_PYTHON")
    if python is None:
        pytest.skip("CLEANRL_PYTHON does not name an interpreter with cleanrl; use `make clients`")
    folder = run(tmp_path, "-c", PLACE, python=python).splitlines()[-1]
    script = f"{folder}/ppo_continuous_action.py"
    few = ("--total-timesteps", str(STEPS), "--num-steps", str(ROLLOUT))
    shown = run(tmp_path, script, "--env-id", ENV, "--cuda", "False", *few, python=python)
    assert shown.count("SPS:") == STEPS // ROLLOUT  # one line an update
    returns = [float(found) for found in re.findall(r"episodic_return=\[([-\d.]+)\]", shown)]
    assert len(returns) == STEPS // 400  # episodes of 400 steps; none failed
    assert all(-500 < found < 400 for found in returns)
    assert list(tmp_path.rglob("events.out.tfevents.*"))
