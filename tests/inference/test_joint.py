"""Shared parameters and the runs' own numbers in one step: exact where the model is linear."""

from dataclasses import dataclass

import numpy as np
import pytest

from fish_env.inference.estimate.again import with_run_variation
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.free import Free
from fish_env.inference.estimate.joint import descend_jointly
from fish_env.inference.estimate.run_variation import RunVariation
from fish_env.inference.estimate.settle import predicted_variation
from fish_env.inference.estimate.slopes import Slopes
from fish_env.inference.problem import Point
from tests.inference.stated import Evaluated, Numbered, White

RUNS, SAMPLES = 5, 80


@dataclass(frozen=True)
class Spreading(White):
    spread: tuple[float, ...] = (1.0, 1.0)


class Differing(Numbered):
    """Runs with two numbers of their own: ``(1 + bend) * (z x + own . y)`` against a record.

    ``bend`` makes the model curved. The second number cannot be negative if ``positive``.
    """

    def __init__(self, seed=0, bend=0.0, positive=False, truth=(2.0, 1.5, 1.0)):
        rng = np.random.default_rng(seed)
        self.bend = bend
        self.x = rng.standard_normal((RUNS, SAMPLES))
        # Alike to the shared column: in turns, the one would explain the other.
        self.y = rng.standard_normal((RUNS, SAMPLES, 2)) + 2.0 * self.x[:, :, None]
        self.own = np.zeros((RUNS, 2))
        self.true = np.asarray(truth[1:]) * rng.standard_normal((RUNS, 2))
        self.data = self.model(truth[0], self.true) + rng.standard_normal((RUNS, SAMPLES))
        self.variations = (
            RunVariation("first", "1", 1.0),
            RunVariation("second", "1", 1.0, positive=positive),
        )
        super().__init__()

    def left(self, z, effects):
        return self.data - self.model(z[0], self.own)

    def model(self, shared, own):
        linear = shared * self.x + np.einsum("rsk,rk->rs", self.y, own)
        return linear + self.bend * np.sin(linear)

    def variation_slopes(self, point, noise, filtered, steps):
        columns = []
        for k, step in enumerate(steps):
            further = self.own.copy()
            further[:, k] += step
            moved = self.model(point.z[0], further) - self.model(point.z[0], self.own)
            columns.append(-moved[self.which].ravel() / step)
        return np.column_stack(columns)

    def filtered(self, point, noise, near=()):
        rows = self._rows(point.z, point.effects, noise)
        return [Evaluated(float(-0.5 * row @ row), row) for row in rows]


def descended(problem, iterations=8, start=0.0, give_up_above=np.inf):
    slopes = Slopes(Free(problem, (), ()), Spreading())
    return descend_jointly(problem, slopes, np.array([start]), iterations, 0.01, give_up_above)


def likelihood_of(problem, vector):
    """-2 log density of a linear record, all random numbers in its covariance, but for a constant.

    Args:
        problem: the runs.
        vector: (1,) the shared coefficient.
    """
    value = float(vector @ vector)
    for x, y, data in zip(problem.x, problem.y, problem.data, strict=True):
        covariance = np.eye(SAMPLES) + y @ y.T
        left = data - vector[0] * x
        value += left @ np.linalg.solve(covariance, left) + np.linalg.slogdet(covariance)[1]
    return value


def test_one_step_solves_a_linear_model():
    """The minimum is that of the likelihood with the numbers in the covariance; so is its value."""
    problem = Differing()
    _, vector, value, _, _ = descended(problem, iterations=1)
    assert value == pytest.approx(likelihood_of(problem, vector), rel=1e-9)
    for off in (-1e-3, 1e-3):
        assert likelihood_of(problem, vector + off) > value


def test_own_numbers_are_the_best_predictions():
    problem = Differing()
    moved, vector, _, _, _ = descended(problem, iterations=1)
    for r in range(RUNS):
        y, left = problem.y[r], problem.data[r] - vector[0] * problem.x[r]
        exact = np.linalg.solve(y.T @ y + np.eye(2), y.T @ left)
        assert moved.own[r] == pytest.approx(exact, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("beyond", "steps"), [(10.0, True), (-40.0, False)])
def test_it_gives_up_where_the_value_with_the_numbers_integrated_out_stays_above(beyond, steps):
    """That is the value it returns, dozens above the one at the likeliest numbers."""
    _, best, least, _, _ = descended(Differing())
    _, vector, _, _, _ = descended(Differing(), 1, give_up_above=least + beyond)
    assert vector == pytest.approx(best if steps else 0.0, abs=1e-3)


def test_turns_explain_the_one_by_the_other():
    """What joint steps are for: numbers predicted first take what is shared."""
    problem = Differing(truth=(2.0, 0.2, 0.2))
    first, _ = predicted_variation(problem, Point(np.zeros(1), {}), Spreading())
    joint, vector, _, _, _ = descended(problem, iterations=1)
    assert np.abs(first.own - problem.true).mean() > 3.0 * np.abs(joint.own - problem.true).mean()
    assert vector[0] == pytest.approx(2.0, abs=0.6)


@pytest.mark.parametrize("seed", range(4))
def test_a_curved_model_ends_where_nothing_is_gained(seed):
    problem = Differing(seed, bend=0.5)

    def worth(one, shared):
        left = one.data - one.model(shared, one.own)
        return np.sum(left**2) + np.sum(one.own**2) + shared**2

    moved, vector, _, _, _ = descended(problem, iterations=30)
    assert worth(moved, vector[0]) < worth(problem, 0.0)
    again, further, _, _, _ = descended(moved, iterations=5, start=vector[0])
    assert worth(again, further[0]) <= worth(moved, vector[0])
    assert worth(again, further[0]) > worth(moved, vector[0]) - 2.0


class Steep(Differing):
    """Steeper, the farther down the shared number is: whole steps lead beyond a limit."""

    lowest = -0.9

    def model(self, shared, own):
        return super().model(np.exp(-5.0 * shared), own)

    def filtered(self, point, noise, near=()):
        self.tried.add(round(float(point.z[0]), 6))
        return super().filtered(point, noise, near)

    def _rows(self, z, effects, noise):
        rows = super()._rows(z, effects, noise)
        return np.full_like(rows, np.nan) if z[0] < self.lowest else rows


def test_steps_go_on_with_the_damping_that_was_needed():
    """Without that every step would begin with whole ones, which diverge."""
    problem = Steep(truth=(-0.8, 0.1, 0.1))
    problem.tried = set()
    _, vector, _, _, _ = descended(problem, iterations=30)
    assert vector[0] == pytest.approx(-0.8, abs=0.02)
    assert sum(z < problem.lowest for z in problem.tried) == 3


class Bounded(Differing):
    """Whole steps from far away lead nearly as far to the other side."""

    def model(self, shared, own):
        return super().model(np.arctan(shared), own)


def test_a_whole_step_that_hardly_gains_does_not_end_the_steps():
    problem = Bounded(truth=(0.0, 0.0, 0.0))
    problem.y *= 0.01
    _, vector, _, _, _ = descended(problem, iterations=1, start=1.38)
    assert abs(vector[0]) < 0.5


class Flattered(Bounded):
    """Samples that follow a motion only when asked again: before, any other seems to fit better."""

    flattery = 0.0

    def with_variation(self, values, point, noise, near=()):
        found = super().with_variation(values, point, noise, near)
        found.flattery = 0.0 if np.array_equal(values, self.variation) else 30.0
        return found

    def filtered(self, point, noise, near=()):
        found = super().filtered(point, noise, near)
        return [Evaluated(f.log_likelihood + self.flattery, f.residuals) for f in found]


def test_a_step_counts_after_samples_follow_the_motion():
    problem = Flattered(truth=(0.0, 0.0, 0.0))
    problem.y *= 0.01
    problem.own += 0.01
    _, vector, _, _, _ = descended(problem, iterations=1, start=1.38)
    assert abs(vector[0]) < 0.5


class Pulled(Differing):
    """The likelihood has a term that no residual shows, as that of a filter's gains."""

    middle, strength = 0.5, 100.0

    def filtered(self, point, noise, near=()):
        self.evaluated.append(float(point.z[0]))
        own = self.strength * (point.z[0] - self.middle) ** 2
        found = super().filtered(point, noise, near)
        return [Evaluated(f.log_likelihood - own, f.residuals) for f in found]


def test_the_minimum_is_known_by_two_points_where_slopes_miss_part_of_it():
    """Slopes promise more there, and no damped step keeps it."""
    problem = Pulled(truth=(2.0, 0.1, 0.1))
    problem.y *= 0.01
    problem.evaluated = []
    at = 0.0
    for _ in range(8):
        _, vector, _, _, _ = descended(problem, iterations=8, start=at)
        at = float(vector[0])
    assert at < 1.9
    problem.evaluated.clear()
    _, vector, _, _, _ = descended(problem, iterations=8, start=at)
    assert vector[0] == at
    assert len(problem.evaluated) == 3


def test_no_number_is_negative_that_cannot_be():
    problem = Differing(positive=True)
    assert (problem.true[:, 1] < -0.5).any()
    moved, _, value, _, _ = descended(problem)
    free, _, anywhere, _, _ = descended(Differing())
    assert (free.own[:, 1] < -0.1).any()
    assert np.all(moved.own[:, 1] >= 0.0)
    assert value > anywhere


class Cornered(Differing):
    """The first run has a corner: its first number does the same on either side of zero."""

    def model(self, shared, own):
        linear = super().model(shared, own)
        linear[0] += 30.0 * abs(own[0, 0]) * self.x[0]
        return linear


def test_a_run_with_a_corner_stays_and_holds_back_no_other():
    problem = Cornered(truth=(2.0, 0.3, 0.3))
    problem.data[0] = problem.x[0]
    moved, vector, _, _, _ = descended(problem, iterations=1)
    assert np.abs(moved.own[0]).max() == 0.0
    for r in range(1, RUNS):
        y, left = problem.y[r], problem.data[r] - vector[0] * problem.x[r]
        exact = np.linalg.solve(y.T @ y + np.eye(2), y.T @ left)
        assert moved.own[r] == pytest.approx(exact, rel=1e-6, abs=1e-9)


def test_a_fit_takes_joint_steps_where_runs_differ():
    problem = Differing()
    found = fit(problem, noise=Spreading(), rounds=1, iterations=3)
    _, vector, value, _, _ = descended(problem)
    assert found.estimates[0] == pytest.approx(vector[0], rel=1e-4)
    assert found.objective == pytest.approx(value, abs=1e-3)


def test_what_diverges_at_the_start_is_refused():
    problem = Differing()
    problem.data = np.full_like(problem.data, np.nan)
    with pytest.raises(np.linalg.LinAlgError, match="start of the fit"):
        descended(problem)


class Fragile(Differing):
    """A run diverges where its first number is large."""

    def filtered(self, point, noise, near=()):
        found = super().filtered(point, noise, near)
        lost = np.abs(self.own[self.which, 0]) > 5.0
        return [
            Evaluated(-np.inf, np.full_like(f.residuals, np.nan)) if gone else f
            for f, gone in zip(found, lost, strict=True)
        ]


def test_a_run_that_diverges_begins_with_usual_numbers():
    """They suited another model."""
    problem, plain = Fragile(), Fragile()
    problem.own[2] = 6.0, -6.0
    found = descended(problem)
    assert found[2] == pytest.approx(descended(plain)[2], rel=1e-6)


class Unstable(Differing):
    """A filter that diverges under less noise than it begins with."""

    def fitted_noise(self, point, noise, final, filtered, leverage):
        return Spreading(sd=0.5)

    def filtered(self, point, noise, near=()):
        found = super().filtered(point, noise, near)
        if noise.sd >= 1.0:
            return found
        return [Evaluated(-1e238, 1e119 * run.residuals) for run in found]


def test_a_fit_keeps_the_noise_under_which_its_filter_is_stable():
    """The next one is finite, and of no use: no step can be taken there."""
    found = fit(Unstable(), noise=Spreading(), rounds=3)
    assert found.noise == Spreading()
    assert found.objective == pytest.approx(fit(Differing(), noise=Spreading()).objective, rel=1e-3)


class Unmoved(Differing):
    """A problem that is itself with the numbers that its runs have already."""

    def with_variation(self, values, point, noise, near=()):
        if np.array_equal(values, self.variation):
            return self
        return super().with_variation(values, point, noise, near)


def test_a_spread_is_fitted_also_where_runs_begin_with_the_numbers_they_have():
    """What runs differ in shows in the noise model, not in whether the problem is another one."""
    own = fit(Unmoved(), noise=Spreading(spread=(0.0, 0.0)), refit_noise=False)
    assert not own.problem.variation.any()
    varied = with_run_variation(own)
    assert max(varied.noise.spread) > 0.3
    assert varied.problem.variation.any()
    assert varied.objective < own.objective - 100.0


class Misleading(Differing):
    """Noise that suits some runs, and all of them together less."""

    def fitted_noise(self, point, noise, final, filtered, leverage):
        return Spreading(sd=0.6 * noise.sd)

    def filtered(self, point, noise, near=()):
        rows = self._rows(point.z, point.effects, noise)
        cost = SAMPLES * np.log(noise.sd)
        return [Evaluated(float(-0.5 * row @ row - cost), row) for row in rows]


def test_a_fit_ends_under_no_noise_that_makes_all_runs_less_likely():
    """Else each repeat is a little worse, and further causes would have to make up for that."""
    problem = Misleading()
    once = fit(problem, noise=Spreading(), rounds=2)
    assert once.noise == Spreading()
    assert once.objective == pytest.approx(fit(problem, noise=Spreading(), rounds=1).objective)
    again = fit(once.problem, once.effects, once.point, once.noise, rounds=2)
    assert again.objective <= once.objective + 1e-6
    noisy = fit(problem, noise=Spreading(sd=2.0), rounds=2)
    assert noisy.noise.sd == pytest.approx(1.2), "noise that is better is taken over"
