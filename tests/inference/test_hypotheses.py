"""Ids of parameters and causes: what they are, and how files write them."""

import pickle

import pytest

from fish_env.inference.hypotheses import (
    Coefficient,
    EffectName,
    EffectParameterId,
    effects_of,
    listed,
    name_of,
    of_effects,
    short_name,
)

DRAG, LAG = Coefficient("tail.drag.c0"), EffectName("servo_lag")
TIME, NORTH = EffectParameterId("servo_lag", "time_constant"), EffectParameterId("current", "north")


@pytest.mark.parametrize(
    ("parameter", "text"),
    [(DRAG, "tail.drag.c0"), (TIME, "effects.servo_lag.time_constant")],
)
def test_a_parameter_is_written_as_in_files(parameter, text):
    assert str(parameter) == f"{parameter}" == text


@pytest.mark.parametrize(
    ("cause", "name", "short"),
    [(DRAG, "parameter:tail.drag.c0", "tail.drag.c0"), (LAG, "servo_lag", "servo_lag")],
)
def test_a_cause_is_written_as_in_files(cause, name, short):
    assert (name_of(cause), short_name(name_of(cause))) == (name, short)


def test_causes_are_listed_in_the_order_given():
    assert listed([LAG, DRAG], " and ") == "servo_lag and parameter:tail.drag.c0"


def test_an_id_is_equal_to_itself_only():
    """Text that reads the same is no id, and neither is an id of another kind."""
    others = (Coefficient("servo_lag"), Coefficient(str(TIME)), str(TIME), str(DRAG), LAG, NORTH)
    assert not {DRAG, TIME} & {*others}
    assert {DRAG, TIME} == {Coefficient(str(DRAG)), pickle.loads(pickle.dumps(TIME))}


def test_values_are_taken_by_effect():
    values = {TIME: 0.1, NORTH: 0.2}
    assert effects_of(values) == {"servo_lag", "current"}
    assert of_effects(values, ["current"]) == {NORTH: 0.2}
