"""Causes below the threshold count only where something is missing and they leave nothing."""

from types import SimpleNamespace

import pytest

from fish_env.diagnosis import pipeline


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
