"""What has the form that a training needs, and what only seems to."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.envs.layout import GOAL, GUIDE
from robofish_agents.training.forms import check_form
from robofish_agents.training.stack import make_stack
from tests.agents.test_checkpoint import PPO


@pytest.mark.parametrize("task", ["path", "hold"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("path_points", 1e9), ("path_points", -1.0), ("leg", 1e9), ("leg", -1.0), ("leg", np.nan)],
)
def test_legs_that_do_not_exist_are_refused(name, value, task):
    """Compiled code reads waypoints by their number, wherever that is in memory."""
    config = replace(PPO, task=task)
    stack = make_stack(config)
    stack.outside.reset()
    state = stack.state()
    make_stack(config).restore(state)
    rows = stack.fish.parts[0].env.batch._rows
    at = rows.ROW_GUIDE + GUIDE.index("leg")
    if name == "path_points":
        at = rows.ROW_GOAL + GOAL.index("path_points")
    state["envs"][0]["batch"]["arrays"]["_data"][at] = value
    with pytest.raises(ValueError, match=r"paths that do not exist|does not fit"):
        make_stack(config).restore(state)


@pytest.mark.parametrize(
    ("value", "like"),
    [
        (1, 2), (1, 2.0), (np.array(1.5), 2.0), (True, 0.0), (False, True), ("a", "b"),
        ([1, 2], (3, 4)), ({"a": 1}, {"a": 2}), (None, None), (np.zeros(2), np.ones(2)),
        (np.array([np.inf]), np.array([-np.inf])), (2**100, 1),
    ],
)  # fmt: skip
def test_values_of_one_form(value, like):
    check_form(value, like, "here")


@pytest.mark.parametrize(
    ("value", "like"),
    [
        ("1", 2), (1.5, 2), (True, 2), (np.nan, 2.0), (np.inf, 2.0), (None, 2.0), (1, True),
        (1, "b"), (1, None), ([1], [1, 2]), ([1], 1), ({}, {"a": 1}), ({"a": 1, "b": 2}, {"a": 1}),
        ([1], {"a": 1}), (np.zeros(2), np.zeros(3)), (np.zeros(2, np.float32), np.zeros(2)),
        ([0.0, 0.0], np.zeros(2)), (np.array([np.nan, 0.0]), np.zeros(2)), (np.zeros(2), 1.0),
    ],
)  # fmt: skip
def test_values_of_another_form(value, like):
    with pytest.raises(ValueError, match=r"here.* does not fit") as caught:
        check_form(value, like, "here")
    assert str(caught.value).isprintable()
