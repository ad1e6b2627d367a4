"""A search ends where so much has been simulated, and the result says so."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fish_env.diagnosis.answer import as_dict
from fish_env.diagnosis.pipeline import diagnose_runs
from fish_env.identification.series import SeriesProblem
from fish_env.inference.effort import CUT_SHORT, FULL, PATIENT, effort_of
from fish_env.inference.pipeline import infer
from fish_env.inference.policy import POLICY
from fish_env.inference.work import Work
from tests.identification.synthetic import PATHS, Setup, simulate
from tests.inference.boat import RUDDER_BIAS, sail
from tests.inference.boat_problem import BoatProblem


def test_steps_are_counted_from_all_threads():
    work = Work(size=4.0)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work.add, [1] * 4000))
    assert work.passes == 1000.0


def test_a_refusal_is_remembered():
    work = Work(most_passes=2.0)
    work.add(1)
    assert work.allows_more()
    assert not work.cut_short
    work.add(1)
    assert not work.allows_more()
    assert work.cut_short


@pytest.mark.parametrize(("most_passes", "named"), [(np.inf, ("rudder_bias",)), (0.0, ())])
def test_where_no_search_may_begin_nothing_is_named(most_passes, named):
    problem = BoatProblem(sail(np.random.default_rng(0), 4, {RUDDER_BIAS: 0.03}))
    problem.work = Work(most_passes=most_passes)
    result = infer(problem)
    assert result.verdict.causes == named
    assert result.cut_short == (most_passes == 0.0)
    assert (result.verdict.name == "outside_library") == result.cut_short


def test_each_parameter_vector_is_one_pass():
    """A filter takes as many as its state has slopes, and one for itself."""
    problem = SeriesProblem(simulate(Setup(runs=2, duration=2.0)), paths=PATHS)
    filtered = problem.filtered(problem.start, problem.default_noise())
    assert problem.work.passes == 20.0
    half = problem.some([0])
    half.innovations(np.zeros((len(PATHS), 3)), {}, problem.default_noise(), filtered[:1])
    assert half.work is problem.work
    assert problem.work.passes == pytest.approx(20.0 + 3.0 / 2.0, rel=0.01)


def test_a_patient_diagnosis_has_no_limit():
    assert FULL.most_passes == POLICY.most_passes
    assert effort_of(quick=False, patient=True) is PATIENT
    assert np.isinf(PATIENT.most_passes)


@pytest.mark.slow
def test_the_answer_says_that_the_search_was_cut_short():
    found = diagnose_runs(simulate(Setup(runs=2, duration=4.0)), quick=True)
    whole = as_dict(found)
    found.problem.work.cut_short = True
    short = as_dict(found)
    assert short["left_out"] == list(CUT_SHORT) != whole["left_out"]
    (note,) = set(short["notes"]) - set(whole["notes"])
    assert "--patient" in note
