"""The verdicts of an attribution, and that adequacy comes before a name."""

from types import SimpleNamespace

import pytest

from fish_env.inference.verdict import VERDICTS, decide


def attribution(causes=(), rivals=()):
    return SimpleNamespace(
        accepted=SimpleNamespace(causes=tuple(causes)),
        rivals=tuple(SimpleNamespace(causes=tuple(names)) for names in rivals),
    )


def shown(*excited):
    return tuple(SimpleNamespace(excited=value) for value in excited)


SEEN = shown(True, True, False)
BLIND = shown(False, False, True)
PARAMETER = "parameter:mass.total"
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
    verdict = decide(attribution(causes, rivals), SimpleNamespace(reached=reached), preconditions)
    assert verdict.name == name
    assert name in VERDICTS
    assert verdict.causes == (() if name == "outside_library" else causes)
    assert verdict.alternatives == rivals


def test_an_effect_with_a_coefficient_is_a_cause():
    found = decide(attribution(("current", PARAMETER)), SimpleNamespace(reached=True), SEEN)
    assert found.name == "cause"
    assert found.causes == ("current", PARAMETER)


def test_nothing_is_named_while_something_is_left():
    for causes in ((), (PARAMETER,), ("current", "wave")):
        for rivals in ((), (("tether",),)):
            found = decide(attribution(causes, rivals), SimpleNamespace(reached=False), BLIND)
            assert (found.name, found.causes, found.alternatives) == ("outside_library", (), ())
