"""CleanRL's PPO and SAC, the scripts of its last release as they are.

CleanRL 1.2.0 was written for Gymnasium below 1.0 and OpenAI gym 0.23, so it runs in an environment
of its own, whose interpreter CLEANRL_PYTHON names; `make clients` makes it.
"""

import os
import re

import pytest

from tests.clients.running import ENV, run

PLACE = "import importlib.util as u; print(u.find_spec('cleanrl').submodule_search_locations[0])"
STEPS, ROLLOUT = 4096, 512
WARM_UP, SAC_STEPS = 1000, 2000


@pytest.fixture
def train(tmp_path):
    """Runs a script of CleanRL for a few steps; returns what it printed and the returns in it."""
    python = os.environ.get("CLEANRL_PYTHON")
    if python is None:
        pytest.skip("CLEANRL_PYTHON does not name an interpreter with cleanrl; use `make clients`")

    def trained(name: str, env: str, *few: str) -> tuple[str, list[float]]:
        script = run(tmp_path, "-c", PLACE, python=python).splitlines()[-1] + f"/{name}.py"
        shown = run(tmp_path, script, "--env-id", env, "--cuda", "False", *few, python=python)
        assert list(tmp_path.rglob("events.out.tfevents.*"))
        return shown, [float(n) for n in re.findall(r"episodic_return=\[?([-\d.]+)", shown)]

    return trained


def test_cleanrls_ppo_trains(train):
    few = ("--total-timesteps", str(STEPS), "--num-steps", str(ROLLOUT))
    shown, returns = train("ppo_continuous_action", ENV, *few)
    assert shown.count("SPS:") == STEPS // ROLLOUT  # one line an update
    assert len(returns) == STEPS // 400  # episodes of 400 steps; none failed
    assert all(-500 < found < 400 for found in returns)


def test_cleanrls_sac_trains(train):
    few = ("--total-timesteps", str(SAC_STEPS), "--learning-starts", str(WARM_UP))
    shown, returns = train("sac_continuous_action", ENV.partition(":")[2], *few)
    assert shown.count("SPS:") == (SAC_STEPS - WARM_UP) // 100 - 1  # one line in 100 steps
    assert len(returns) >= SAC_STEPS // 400  # no longer than 400 steps
    assert all(-500 < found < 400 for found in returns)
