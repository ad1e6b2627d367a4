"""The script that compares agents tells a good one from a bad one, and keeps off the suites."""

import numpy as np
import pytest

from robofish_agents.controllers import PIDController
from robofish_agents.evaluation.suites import RESERVED_SEEDS
from scripts import compare_agents

SIZES = ["--task", "hold", "--suite", "calm", "--episodes", "4"]


def test_an_agent_does_as_well_as_itself(capsys):
    compare_agents.main(["pid", "pid", *SIZES])
    text = capsys.readouterr().out
    assert text.count("pid: success 100.00 %") == 2
    assert "beside pid: +0.00 ± 0.00 %" in text


def test_an_agent_that_does_nothing_is_found_out(capsys, monkeypatch):
    act = PIDController.act
    monkeypatch.setattr(PIDController, "act", lambda self, seen: 0.0 * act(self, seen))
    compare_agents.main(["pid", *SIZES])
    text = capsys.readouterr().out
    assert "success 0.00 %" in text
    assert "100.00 out in speed" in text


def test_an_interval_is_that_of_a_mean():
    values = np.array([1.0] * 90 + [0.0] * 10)
    assert compare_agents.interval(values) == "+90.00 ± 5.91"


@pytest.mark.parametrize("first", [RESERVED_SEEDS.start - 2, RESERVED_SEEDS.stop - 1])
def test_episodes_of_suites_are_refused(first):
    with pytest.raises(SystemExit):
        compare_agents.main(["pid", *SIZES, "--first", str(first)])
