"""The verdicts of an attribution, and that adequacy comes before a name."""

import pytest

from fish_env.inference.adequacy import Adequacy
from fish_env.inference.attribution import Attribution
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.preconditions import Precondition
from fish_env.inference.screening import Screen
from fish_env.inference.verdict import VERDICTS, decide
from tests.inference.stated import Stated, apart, effect, fit_of

SHOWN = Screen((), -11.0, 0.05)
FIT = fit_of(Stated(apart({"current": [0.0]}), [effect("current")]))
LEFT = {reached: Adequacy(reached, -11.0, ()) for reached in (True, False)}


def attribution(causes=(), rivals=()):
    accepted, *others = (Explanation(tuple(names), FIT) for names in (causes, *rivals))
    return Attribution(Explanation((), FIT), SHOWN, SHOWN, accepted, tuple(others), (), 0.0)


def shown(*excited):
    return tuple(Precondition(f"effect {i}", 0.1, {}, None, e) for i, e in enumerate(excited))


SEEN = shown(True, True, False)
BLIND = shown(False, False, True)
PARAMETER = Coefficient("mass.total")
CASES = {
    "no_misfit": ((), (), True, SEEN),
    "not_excited": ((), (), True, BLIND),
    "parameters": ((PARAMETER,), (), True, SEEN),
    "cause": (("current",), (), True, SEEN),
    "ambiguous": (("current",), (("tether",),), True, SEEN),
    "outside_library": (("current",), (), False, SEEN),
}


@pytest.mark.parametrize("name", CASES)
def test_each_verdict(name):
    causes, rivals, reached, preconditions = CASES[name]
    verdict = decide(attribution(causes, rivals), LEFT[reached], preconditions)
    assert verdict.name == name
    assert name in VERDICTS
    assert verdict.causes == (() if name == "outside_library" else causes)
    assert verdict.alternatives == rivals


def test_an_effect_with_a_coefficient_is_a_cause():
    found = decide(attribution(("current", PARAMETER)), LEFT[True], SEEN)
    assert found.name == "cause"
    assert found.causes == ("current", PARAMETER)


def test_nothing_is_named_while_something_is_left():
    for causes in ((), (PARAMETER,), ("current", "wave")):
        for rivals in ((), (("tether",),)):
            found = decide(attribution(causes, rivals), LEFT[False], BLIND)
            assert (found.name, found.causes, found.alternatives) == ("outside_library", (), ())
