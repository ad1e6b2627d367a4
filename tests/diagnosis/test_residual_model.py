"""What no known cause explains, described: against a foreign force of known size."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.diagnosis.pipeline import fitted_and_final
from fish_env.diagnosis.report.remainder import residual_model as shown
from fish_env.diagnosis.residual_model import log_likelihoods, residual_model
from fish_env.identification import SeriesProblem, fit
from fish_env.identification.generic_forces import BoundForces, generic_forces
from fish_env.inference.adequacy import adequacy
from fish_env.inference.gain import by_window
from tests.diagnosis.report_cases import RESIDUAL, answer
from tests.hidden.cases import make_case
from tests.identification.synthetic import PATHS, Setup, simulate

SWIRL = 9
"""Number of an outside case whose tail rolls the fish by its beat speed squared."""


def fits(tier, number, folder):
    """The refitted baseline of a case, its final runs, and the truth."""
    truth = make_case(tier, number, folder)
    dataset = load_dataset(folder)
    fitted, final = fitted_and_final(dataset, 0)
    own = fit(SeriesProblem(dataset, None, fitted), rounds=2)
    return own, SeriesProblem(dataset, None, final), truth


@pytest.fixture(scope="module")
def swirled(tmp_path_factory):
    own, final, truth = fits("outside", SWIRL, tmp_path_factory.mktemp("outside") / "data")
    assert list(truth.foreign) == ["swirl"]
    left = adequacy(own, np.random.default_rng(0))
    assert not left.reached
    return residual_model(own, left.threshold, final), left, own, final, truth


@pytest.mark.slow
@pytest.mark.long
def test_a_foreign_moment_is_described_by_what_makes_it(swirled):
    """The generator knows amplitude times frequency as (2 pi beat)."""
    model, left, own, _, truth = swirled
    [term] = [t for t in model.terms if t.direction == "roll"]
    assert term.function == "beat speed^2"
    right = truth.foreign["swirl"]["coefficient"] * (2.0 * np.pi) ** 2 * term.scale
    assert abs(term.coefficient - right) < 3.0 * term.error
    assert term.error < 0.03 * abs(right)
    # One linear step, with the disturbance that the misfit had left, gets it wrong.
    first = residual_model(own, left.threshold, None, rounds=1)
    assert first is None or abs(first.terms[0].coefficient - right) > 3.0 * term.error


@pytest.mark.slow
@pytest.mark.long
def test_it_predicts_runs_that_did_not_choose_it(swirled):
    model, *_ = swirled
    assert model.judged.gain_ci95[0] > 0.0
    without, beside = model.noise
    assert beside.moment_sd < 0.5 * without.moment_sd


@pytest.mark.slow
@pytest.mark.long
def test_a_model_that_does_not_hold_elsewhere_says_so(swirled):
    """The same judgement of runs in which the moment acts the other way round."""
    *_, own, final, _ = swirled
    _, left, *_ = swirled
    signs = [-1.0 if c in {"roll", "p", "yaw", "r", "y", "v"} else 1.0 for c in final.channels]
    other = [
        replace(
            run,
            measured=run.measured * signs,
            command_values=run.command_values * [-1.0, 1.0, 1.0, 1.0, -1.0],
        )
        for run in final.runs
    ]
    model = residual_model(own, left.threshold, final.with_runs(other))
    assert model.judged.gain_ci95[1] < 0.0


def test_where_nothing_is_missing_there_is_nothing_to_describe(tmp_path):
    own, final, _ = fits("null", 9, tmp_path / "data")
    left = adequacy(own, np.random.default_rng(0))
    assert residual_model(own, left.threshold, final) is None


@pytest.mark.slow
@pytest.mark.long
def test_runs_kept_for_judging_refute_chance_and_nothing_else(swirled, tmp_path):
    """Chance gets its say by a threshold that it just passes."""
    own, final, _ = fits("null", 9, tmp_path / "data")
    chance = just_asked(adequacy(own, np.random.default_rng(0)))
    model = residual_model(own, chance.threshold, final)
    assert chance.judged(model.judged.gain).refuted < 0.0
    model, left, *_ = swirled
    assert just_asked(left).judged(model.judged.gain).refuted is None


def just_asked(left):
    """A test with the threshold a little above what is asked for most, and nothing strained."""
    asked = left.misfits[0].log_p
    lax = replace(left, reached=False, threshold=asked + 0.1, implausible=())
    assert lax.slight
    return lax


def test_scores_of_samples_add_up_to_the_likelihood_of_the_run():
    setup = Setup(runs=1)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    measured = problem.runs[0].measured.copy()
    measured[40:60, 2] = np.nan
    problem = problem.with_runs([replace(problem.runs[0], measured=measured)])
    result = problem.filtered(problem.start, setup.noise)
    total = np.concatenate(by_window(problem, log_likelihoods(problem, result), np.nansum)).sum()
    assert total == pytest.approx(result[0].log_likelihood, rel=1e-9)


def test_a_known_wrench_does_what_the_same_push_does():
    """In the filter, in the lanes with its gains, and as a probe of a generic force."""
    setup = Setup(runs=2)
    problem = SeriesProblem(simulate(setup), paths=PATHS)
    own = fit(problem, iterations=1, refit_noise=False, noise=setup.noise)
    forces = generic_forces(problem.runs, own.filtered, problem.channels)
    [column] = [c for c in forces.columns if forces.words(c) == ("u|u|", "yaw")]
    push = BoundForces(own, forces).changes(np.array([column]))[:, 0]
    wrenches = [np.zeros((len(basis), 6)) for basis in forces.bases]
    for wrench, basis in zip(wrenches, forces.bases, strict=True):
        wrench[:, 5] = 1e-5 * basis[:, column // 6]
    runs = [replace(r, wrench=w) for r, w in zip(problem.runs, wrenches, strict=True)]
    carrying = problem.with_runs(runs)
    before, given = (
        p.with_long_steps().innovations(own.point.z[:, None], {}, own.noise, own.filtered)[0]
        for p in (problem, carrying)
    )
    assert given - before == pytest.approx(push, abs=1e-9)
    assert np.abs(push).max() > 1e-3
    again = carrying.filtered(own.point, own.noise)
    lanes = carrying.innovations(own.point.z[:, None], {}, own.noise, again)[0]
    alone = np.concatenate([result.innovations.ravel() for result in again])
    assert lanes == pytest.approx(alone, abs=1e-8)


def test_the_beginning_of_a_run_keeps_its_wrench():
    run = SeriesProblem(simulate(Setup(runs=1)), paths=PATHS).runs[0]
    known = np.random.default_rng(0).standard_normal((len(run.clock), 6))
    cut = replace(run, wrench=known).until(2.0)
    assert np.array_equal(cut.known_wrench, known[: len(cut.clock)])
    assert not run.until(2.0).known_wrench.size


def test_the_report_tells_it():
    full = answer("outside_library")
    page = shown(full)
    assert "w|w|" in page
    assert "It improves the prediction of the held-out runs r01" in page
    assert "beside current" in page
    doubtful = {"estimate": 4.0, "ci95": [-10.0, 18.0]}
    model = RESIDUAL | {"gain": RESIDUAL["gain"] | {"log_likelihood": doubtful}}
    weak = full | {"residual_model": model}
    assert "does not significantly improve" in shown(weak)
    bad = RESIDUAL["gain"] | {"log_likelihood": {"estimate": -40.0, "ci95": [-60.0, -20.0]}}
    assert "worsens" in shown(full | {"residual_model": RESIDUAL | {"gain": bad}})
