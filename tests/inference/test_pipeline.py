"""Where something is left: held-out runs where nothing is named, then weaker causes."""

from types import SimpleNamespace

import pytest

from fish_env.inference import pipeline
from fish_env.inference.adequacy import Adequacy, Misfit


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
    attribution, adequacy = pipeline.with_weaker_causes(before, left, (), None, print)
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
def test_one_half_of_the_runs_refutes_chance_in_the_other(monkeypatch, causes, gain, reached):
    """Where nothing is named."""
    tested = []

    def describe(fitted, threshold, other):
        tested.append((fitted.runs, other.runs))
        return SimpleNamespace(held_out_gain=gain)

    def some(runs):
        return SimpleNamespace(runs=tuple(runs), noise_of=lambda fit: fit.noise)

    monkeypatch.setattr(pipeline, "fit", lambda half, *given, **settings: half)
    problem = SimpleNamespace(run_count=5, some=some)
    own = SimpleNamespace(problem=problem, effects=(), point=None, noise=None, released=())
    found = SimpleNamespace(accepted=SimpleNamespace(causes=causes, fit=own))
    left = Adequacy(False, -11.0, (Misfit("u", "heave", -12.0, 0.01),))
    after = pipeline.cross_validated(found, left, describe, print)
    assert after.reached == reached
    assert after.refuted == (2.0 * gain if reached else None)
    assert tested == ([] if causes else [((0, 2, 4), (1, 3)), ((1, 3), (0, 2, 4))])
