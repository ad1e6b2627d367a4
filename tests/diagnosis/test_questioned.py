"""What is left is questioned: by the final runs where nothing is named, then by weaker causes."""

from types import SimpleNamespace

import pytest

from fish_env.diagnosis import pipeline
from fish_env.diagnosis.adequacy import Adequacy, Misfit


def found(*causes):
    return SimpleNamespace(accepted=SimpleNamespace(causes=causes, fit=causes), tolerated=0.0)


@pytest.mark.parametrize(
    ("more", "reached", "kept"),
    [
        (("wave",), True, ("wave",)),
        (("wave",), False, ()),  # it explains something, but not all
        ((), True, ()),  # nothing weaker was found
    ],
)
def test_a_weaker_cause_is_kept_if_it_leaves_nothing(monkeypatch, more, reached, kept):
    before, left = found(), SimpleNamespace(reached=False)
    monkeypatch.setattr(pipeline, "extended", lambda *given: found(*more))
    monkeypatch.setattr(pipeline, "adequacy", lambda *given: SimpleNamespace(reached=reached))
    attribution, adequacy = pipeline._with_weaker_causes(before, left, (), None, print)
    assert attribution.accepted.causes == kept
    assert adequacy.reached == bool(kept)


@pytest.mark.parametrize(
    ("causes", "gain", "reached"),
    [
        ((), -1.0, True),
        ((), 1.0, False),
        (("hull_compression",), -1.0, False),  # it may imitate what acts
    ],
)
def test_final_runs_refute_chance_where_nothing_is_named(monkeypatch, causes, gain, reached):
    model = SimpleNamespace(judged=SimpleNamespace(gain=gain))
    monkeypatch.setattr(pipeline, "_described", lambda *given: model)
    left = Adequacy(False, -11.0, (Misfit("u", "heave", -12.0, 0.01),))
    after, described = pipeline._judged_elsewhere(found(*causes), left, None, print)
    assert after.reached == reached
    assert described is (None if causes else model)
