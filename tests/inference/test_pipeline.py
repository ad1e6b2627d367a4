"""Where something is left: held-out runs where nothing is named, then weaker causes."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.adequacy import Adequacy, Misfit
from fish_env.inference.attribution import Attribution, attribute
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.pipeline import cross_validated, with_slow_causes, with_weaker_causes
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import Screen
from tests.inference.stated import Directions, Evaluated, Stated, White, apart, effect

SHOWN = Screen((), -11.0, 0.05)
LEFT = Adequacy(False, -11.0, (Misfit("u", "heave", -12.0, 0.01),))
NAMES = ("wave", *(f"effect {i}" for i in range(60)))
UNKNOWN = "unknown"


class Pushed(Stated):
    """A problem with a generic force on each sample, in all runs alike."""

    def generic_terms(self, fit):
        return Directions(np.tile(np.eye(self.samples), (1, self.run_count)))


@pytest.mark.parametrize(
    ("wave", "unknown", "kept"),
    [
        (1.8, 0.0, ("wave",)),
        (1.8, 6.0, ()),  # it explains something, but not all
        (0.0, 0.0, ()),  # nothing weaker was found
    ],
)
def test_a_weaker_cause_is_kept_if_it_leaves_nothing(wave, unknown, kept):
    targets = {**dict.fromkeys(NAMES, 0.0), "wave": wave, UNKNOWN: unknown}
    runs = {name: np.full(3, size) for name, size in targets.items()}
    problem = Pushed(apart(runs), [effect(name) for name in targets])
    causes = [cause for cause in causes_of(problem) if cause.id != UNKNOWN]
    rng, said = np.random.default_rng(0), []
    before = attribute(fit(problem), causes, rng)
    assert before.accepted.causes == ()
    found, left = with_weaker_causes(before, LEFT, causes, rng, said.append)
    assert ("fitting wave" in said) == (wave > 0.0)
    assert found.accepted.causes == kept
    assert left.reached == bool(kept)
    assert (found is before) == (left is LEFT) == (not kept)


@pytest.mark.parametrize(("wave", "kept"), [(6.0, ("hull_compression", "wave")), (0.0, None)])
def test_what_explains_more_beside_a_cause_is_kept_though_something_is_missing(wave, kept):
    targets = {**dict.fromkeys(NAMES, 0.0), "hull_compression": 8.0, "wave": wave, UNKNOWN: 8.0}
    runs = {name: np.full(3, size) for name, size in targets.items()}
    problem = Pushed(apart(runs), [effect(name, 100.0) for name in targets])
    causes = [cause for cause in causes_of(problem) if cause.id != UNKNOWN]
    first = [cause for cause in causes if cause.id == "hull_compression"]
    rng = np.random.default_rng(0)
    before = attribute(fit(problem), first, rng)
    assert before.accepted.causes == ("hull_compression",)
    found, left = with_weaker_causes(before, LEFT, causes, rng, lambda step: None)
    assert not left.reached
    assert found is before if kept is None else found.accepted.causes == kept


@dataclass(frozen=True)
class Foretelling:
    """A model of what is left that gains so much on runs it has not seen."""

    held_out_gain: float
    fit: Fit


@pytest.mark.parametrize(
    ("causes", "gain", "reached"),
    [
        ((), -1.0, True),
        ((), 1.0, False),
        (("hull_compression",), -1.0, False),  # it may imitate what acts
    ],
)
def test_one_half_of_the_runs_refutes_chance_in_the_other(causes, gain, reached):
    """Where nothing is named."""
    tested = []

    def describe(fitted, threshold, other):
        tested.append((fitted.problem.run_ids, other.run_ids))
        return Foretelling(gain, fitted)

    problem = Stated(apart({"hull_compression": np.ones(5)}), [effect("hull_compression")])
    nothing, found = (Explanation(names, fit(problem, names)) for names in ((), causes))
    attribution = Attribution(nothing, SHOWN, SHOWN, found, (), (), 0.0)
    after = cross_validated(attribution, LEFT, describe, lambda step: None)
    assert after.reached == reached
    assert after.refuted == (2.0 * gain if reached else None)
    odd, even = ("r0", "r2", "r4"), ("r1", "r3")
    assert tested == ([] if causes else [(odd, even), (even, odd)])


class Hiding(Pushed):
    """A disturbance that stays wherever a sample is far off, and then hides what moves it.

    It makes that likelier, but less so than what moved it would.
    """

    STAYS, COST = White(50.0), 5.0

    def fitted_noise(self, point, noise, final, filtered, leverage):
        left = noise.sd * np.concatenate([run.residuals for run in filtered])
        return self.STAYS if np.abs(left).max() > 5.0 else White()

    def filtered(self, point, noise, near=()):
        cost = self.COST if noise == self.STAYS else 0.0
        rows = self._rows(point.z, point.effects, noise)
        return [Evaluated(float(-0.5 * row @ row - cost), row) for row in rows]

    def disturbance_at_limit(self, noise):
        return ("a disturbance that stays",) if noise == self.STAYS else ()

    def passing_noise(self, noise):
        return White() if noise == self.STAYS else None


@pytest.mark.parametrize(
    ("tide", "unknown", "kept"),
    [
        (8.0, 0.0, ("tide",)),
        (8.0, 8.0, ()),  # the disturbance stays with it too
        (0.0, 8.0, ()),
        (0.0, 0.0, ()),  # nothing stays, and nothing is looked for
    ],
)
def test_a_slow_cause_is_found_where_a_disturbance_hid_it(tide, unknown, kept):
    targets = {**dict.fromkeys(NAMES[1:], 0.0), "tide": tide, UNKNOWN: unknown}
    runs = {name: np.full(3, size) for name, size in targets.items()}
    problem = Hiding(apart(runs), [effect(name, reach=10.0) for name in targets])
    causes = [cause for cause in causes_of(problem) if cause.id != UNKNOWN]
    rng, said = np.random.default_rng(0), []
    before = attribute(fit(problem), causes, rng)
    assert before.accepted.causes == ()
    found, left = with_slow_causes(before, LEFT, causes, rng, said.append)
    assert ("searching for slow causes" in said) == (tide > 0.0 or unknown > 0.0)
    assert found.accepted.causes == kept
    assert (found is before) == (left is LEFT) == (not kept)
    assert left.reached == bool(kept)
