"""One run that goes astray: at a corner, after its motion, or where its own numbers promise."""

import numpy as np
import pytest

from fish_env.inference.estimate import own_steps
from fish_env.inference.estimate.free import Free
from fish_env.inference.estimate.joint_model import evaluated
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.policy import POLICY
from tests.inference.test_joint import RUNS, Differing, Spreading, descended, likelihood_of


class Unseen(Differing):
    """The first run shows nothing until its own number and the shared one pass a corner."""

    corner, steepness = 0.5, 100.0

    def __init__(self, seed):
        super().__init__(seed)
        self.data[0] -= self.model(2.0, self.true)[0]

    def model(self, shared, own):
        found = super().model(shared, own)
        beyond = max(shared + own[0, 0] - self.corner, 0.0)
        found[0] = self.steepness * beyond * self.x[0]
        return found


@pytest.mark.parametrize("seed", range(4))
def test_one_run_at_a_corner_does_not_hold_back_the_others(seed):
    """Its slopes say nothing before the step, and it follows by a step of its own after it."""
    moved, vector, _, _, _ = descended(Unseen(seed))
    assert vector[0] == pytest.approx(2.0, abs=0.3)
    assert vector[0] + moved.own[0, 0] == pytest.approx(Unseen.corner, abs=0.1)


def test_without_a_step_of_its_own_it_does(monkeypatch):
    monkeypatch.setattr(own_steps, "OWN_DAMPINGS", ())
    _, vector, _, _, _ = descended(Unseen(0))
    assert vector[0] == pytest.approx(Unseen.corner, abs=0.1)


class Following(Differing):
    """What follows from the motion: a shift of the record, as the motion of each run says it."""

    def __init__(self, following):
        self.following = np.asarray(following, float)[:, None]
        self.shift = np.zeros((RUNS, 1))
        super().__init__(truth=(2.0, 0.0, 0.0))

    def left(self, z, effects):
        return super().left(z, effects) + self.shift

    def with_variation(self, values, point, noise, near=()):
        kept = bool(near) and np.array_equal(values, self.own)
        stays = np.array([one is None for one in near]) if kept else np.ones(RUNS, bool)
        if kept and np.array_equal(self.shift[~stays], self.following[~stays]):
            return self
        moved = super().with_variation(values, point, noise, near)
        moved.shift = np.where(stays[:, None], self.shift, self.following)
        return moved


@pytest.mark.parametrize("far", [1.5, 30.0])
def test_what_follows_from_the_motion_does_so_run_by_run(far):
    """Where it drives a run away, that run stays as it is, and the others do not.

    The nearer one raises the value by less than the noise of all runs.
    """
    driven_away = [far, 0.2, -0.2, 0.3, 0.0]
    moved, vector, _, _, _ = descended(Following(driven_away))
    assert moved.shift[:, 0] == pytest.approx([0.0, *driven_away[1:]])
    assert vector[0] == pytest.approx(2.0, abs=0.3)


def test_a_run_counts_no_gain_that_it_did_not_reach():
    """The linear model promises more than a run has: only what last steps leave over is believed.

    Without a limit it would count in full, as in a fit that has converged.
    """
    problem, noise = Differing(), Spreading()
    slopes = Slopes(Free(problem, (), ()), noise)
    at = evaluated(problem, slopes.free, np.zeros(1), noise)
    marginal = slopes.marginal(problem, at.vector, at.filtered)
    full = likelihood_of(problem, at.vector)
    assert full < at.value + marginal.log_det - 100.0
    value = at.marginal_value(marginal)
    assert value == pytest.approx(at.value + marginal.log_det - RUNS * POLICY.evidence_doubt)
