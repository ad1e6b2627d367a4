"""Verdicts that do not name causes which are too small."""

import pytest

from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.verdict import Verdict, without_minor

MASS = Coefficient("mass.total")


def test_nothing_minor_changes_nothing():
    verdict = Verdict("ambiguous", ("drag", "lag"), (("drag", "play"),))
    assert without_minor(verdict, ()) is verdict


def test_a_minor_cause_is_not_named_and_not_forgotten():
    found = without_minor(Verdict("cause", ("drag", "lag")), ["lag"])
    assert found == Verdict("cause", ("drag",), minor=("lag",))


def test_what_differs_in_minor_causes_alone_is_no_alternative():
    """Another effect in the place of a minor one is as small."""
    verdict = Verdict("ambiguous", ("drag", "lag"), (("drag", "play"), ("drag",)))
    assert without_minor(verdict, ["lag"]) == Verdict("cause", ("drag",), minor=("lag",))


def test_what_differs_in_more_stays_an_alternative():
    verdict = Verdict("ambiguous", ("drag", "lag"), (("mass", "lag"), ("mass",)))
    found = without_minor(verdict, ["lag"])
    assert found == Verdict("ambiguous", ("drag",), (("mass",),), minor=("lag",))


def test_coefficients_that_remain_are_parameters():
    verdict = Verdict("ambiguous", (MASS, "lag"), ((MASS, "play"),))
    assert without_minor(verdict, ["lag"]).name == "parameters"


@pytest.mark.parametrize(
    ("sets", "left"),
    [
        ((("drag", "lag"), ("drag", "play")), (("drag",), ("drag", "play"))),
        ((("drag", "lag"), ("drag",)), ()),
        ((("drag", "lag"), ("drag", "play"), ("drag",)), (("drag",), ("drag", "play"))),
    ],
)
def test_a_partial_verdict_keeps_the_sets_that_still_differ(sets, left):
    found = without_minor(Verdict("partial", ("drag",), sets), ["lag"])
    assert found == Verdict("partial", ("drag",), left, minor=("lag",))


def test_a_verdict_without_any_other_certain_cause_stays():
    verdict = Verdict("partial", ("lag",), (("drag", "lag"), ("lag", "mass")))
    assert without_minor(verdict, ["lag"]) is verdict


def test_a_cause_that_leaves_coefficients_alone_leaves_parameters():
    found = without_minor(Verdict("cause", (MASS, "lag")), ["lag"])
    assert found == Verdict("parameters", (MASS,), minor=("lag",))


def test_what_is_too_faint_is_told_apart_from_what_is_too_small():
    verdict = without_minor(Verdict("cause", ("drag", "lag", "play")), ["lag"])
    found = without_minor(verdict, faint=["play"])
    assert found == Verdict("cause", ("drag",), minor=("lag",), faint=("play",))
    assert found.named(("lag", "drag", "play")) == ("drag",)
