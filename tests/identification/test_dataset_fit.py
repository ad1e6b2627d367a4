"""A fish from a dataset in one call: objectives, what is left out, effects one by one, files."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from fish_env.cli import app
from fish_env.data import load_dataset, write_dataset
from fish_env.errors import DatasetError, EffectError
from fish_env.identification import WholeRunProblem, fit_dataset
from fish_env.identification.greedy import add_effects, held_out_gain
from fish_env.identification.left_out import RunErrors, groups_of, left_out_errors
from fish_env.identification.objectives import OBJECTIVES, refit
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.params import load_fish
from tests.identification.swum_runs import CONDITIONS, FISH, PATHS, swum

WHOLE = OBJECTIVES["whole-run"]
FEW = (*CONDITIONS[:2], *CONDITIONS[:2])


@pytest.fixture(scope="module")
def odd():
    """Runs of two conditions; in the second the fish is another one, so no fit suits both."""
    weak = {"tail_gain": {"gain": 0.7}}
    data = swum([{}, {}, weak, weak], FEW, seconds=6.0)
    problem = WholeRunProblem(data, paths=PATHS)
    return data, fit(problem.settled(problem.start, problem.default_noise()), rounds=2)


@pytest.fixture(scope="module")
def alone(odd):
    """Errors of every run by a fit to a dataset that its condition is not in."""
    data, whole = odd
    found = {}
    for out in groups_of(data, whole.problem, "condition").values():
        kept = replace(data, runs=tuple(r for i, r in enumerate(data.runs) if i not in out))
        problem = WholeRunProblem(kept, paths=PATHS)
        problem = problem.settled(whole.point, whole.noise)
        part = fit(problem, noise=whole.noise, refit_noise=False, iterations=10)
        errors = WHOLE.errors(whole.problem.some(out), part)
        found |= dict(zip(out, errors, strict=True))
    return found


def check_left_out(found, alone):
    """Held-out errors are those of fits that had no access to the runs of the group at all."""
    for i, expected in alone.items():
        for name in ("path", "surge"):
            assert found[i].errors[name] == pytest.approx(expected[name], rel=0.1, abs=5e-4)


def test_what_is_left_out_is_not_fitted(odd, alone):
    data, whole = odd
    groups = groups_of(data, whole.problem, "condition")
    check_left_out(left_out_errors(WHOLE, whole, groups), alone)
    errors = WHOLE.errors(whole.problem, whole)
    leaking = [RunErrors(f"r{i}", None, own) for i, own in enumerate(errors)]
    with pytest.raises(AssertionError):
        check_left_out(leaking, alone)


def test_no_run_is_in_both_parts(odd):
    data, whole = odd
    seen = []

    class Watched:
        def errors(self, problem, part):
            seen.append((set(problem.run_ids), set(part.problem.run_ids)))
            return WHOLE.errors(problem, part)

    left_out_errors(Watched(), whole, groups_of(data, whole.problem, "condition"))
    assert [sorted(held) for held, _ in seen] == [["r0", "r1"], ["r2", "r3"]]
    assert all(not held & kept and len(held | kept) == 4 for held, kept in seen)


def test_runs_are_grouped_by_condition_run_or_command(odd):
    data, whole = odd
    problem = whole.problem
    assert groups_of(data, problem, "condition") == {"c0": [0, 1], "c1": [2, 3]}
    assert list(groups_of(data, problem, "run")) == ["r0", "r1", "r2", "r3"]
    assert groups_of(data, problem, "tail_offset") == {"0": [0, 2], "0.35": [1, 3]}
    with pytest.raises(DatasetError, match="--leave-out pool: choose one of condition, run"):
        groups_of(data, problem, "pool")
    with pytest.raises(DatasetError, match="all runs have one tail_frequency"):
        groups_of(data, problem, "tail_frequency")


def test_an_effect_is_added_that_lowers_the_held_out_error():
    data = swum({"tail_gain": {"gain": 0.8}}, seconds=5.0)
    problem = WholeRunProblem(data, paths=PATHS[:1])
    base = fit(problem.settled(problem.start, problem.default_noise()), rounds=2)
    groups = groups_of(data, problem, "run")
    best, errors, steps = add_effects(WHOLE, base, groups, candidates=["tail_bias", "tail_gain"])
    assert best.effects == ("frequency_scale", "tail_gain")
    assert best.point.effects[EffectParameterId("tail_gain", "gain")] == pytest.approx(
        0.8, abs=0.05
    )
    assert steps[0].added
    assert steps[0].effect == "tail_gain"
    assert not any(step.added for step in steps[1:])
    assert len(errors) == len(data.runs)


def test_a_gain_by_chance_has_no_small_p_value():
    rng = np.random.default_rng(0)

    def drawn(scale):
        return [
            RunErrors(f"r{i}", f"c{i // 2}", {"x": scale * abs(rng.standard_normal())})
            for i in range(40)
        ]

    gain, p = held_out_gain(drawn(1.0), drawn(1.0))
    assert p > 0.01
    gain, p = held_out_gain(drawn(1.0), drawn(0.5))
    assert p < 0.01
    assert gain == pytest.approx(0.5, abs=0.15)


def test_the_command_leaves_conditions_out_and_writes(tmp_path):
    write_dataset(swum({"tail_gain": {"gain": 0.85}}, seconds=6.0), tmp_path / "trials")
    out, results = tmp_path / "swum.yaml", tmp_path / "errors.json"
    words = ["fit", str(tmp_path / "trials"), "--objective", "whole-run"]
    words += ["--effects", "tail_gain", "--leave-out", "condition", "--trust-inputs"]
    done = CliRunner().invoke(app, [*words, "--out", str(out), "--results", str(results)])
    assert done.exit_code == 0, done.output
    for shown in ("effects.tail_gain.gain", "condition left out", "yaw_rate", "mm/s", "written"):
        assert shown in done.output
    assert load_fish(out).name == "swum"
    content = json.loads(results.read_text())
    assert content["objective"] == "whole-run"
    assert {run["group"] for run in content["held_out_runs"]} == {"c0", "c1"}
    assert content["units"]["surge"] == "m/s"
    assert 0.0 < content["held_out_errors"]["path"] < 0.1


def test_steady_means_leave_conditions_out():
    data = load_dataset("msu-steady")
    few = [list(data.conditions).index(c) for c in sorted({*data.conditions})[:3]]
    data = replace(
        data,
        ids=tuple(data.ids[i] for i in few),
        conditions=tuple(data.conditions[i] for i in few),
        commands=data.commands[few],
        observations={name: values[few] for name, values in data.observations.items()},
    )
    result = fit_dataset(data, leave_out="condition", paths=("tail.lift.c1",))
    assert result.objective == "means"
    assert len(result.held_out) == 3
    assert result.units["surge_speed"] == "m/s"
    assert result.mean_held_out["surge_speed"] != result.mean_errors["surge_speed"]
    assert result.fish.info("tail.lift.c1").status == "identified"


def test_one_step_errors_are_in_si_units():
    data = swum(seconds=4.0, conditions=CONDITIONS[:2])
    result = fit_dataset(data, paths=PATHS[:1], leave_out="run")
    assert result.objective == "one-step"
    assert set(result.mean_held_out) == {"x", "y", "yaw"}
    assert 3e-4 < result.mean_held_out["x"] < 3e-3
    low, high = result.fit.interval(result.fit.ids[0])
    assert result.estimates[0].low == pytest.approx(low)
    assert result.estimates[0].before == load_fish(FISH).get(PATHS[0])
    assert low < result.estimates[0].value < high


def test_what_cannot_be_fitted_is_refused_with_the_remedy():
    data = swum(seconds=3.0, conditions=CONDITIONS[:1])
    with pytest.raises(DatasetError, match="--objective slow: choose one of one-step, whole-run"):
        fit_dataset(data, objective="slow")
    with pytest.raises(DatasetError, match="Use --objective one-step or whole-run"):
        fit_dataset(data, objective="means")
    with pytest.raises(DatasetError, match="Use --objective means"):
        fit_dataset("msu-steady", objective="whole-run")
    with pytest.raises(EffectError, match="known: "):
        fit_dataset(data, effects=["tail_wobble"])
    with pytest.raises(EffectError, match="name each once"):
        fit_dataset(data, effects=["tail_gain", "tail_gain"])


def test_a_refit_keeps_the_weights(odd):
    _, whole = odd
    part = refit(WHOLE, whole, whole.problem.some([0, 1]))
    assert part.noise == whole.noise
    assert part.effects == whole.effects


def test_a_refit_forgets_what_is_left_out_however_little_it_says():
    """Runs of one fish: one less moves the estimates by a part of their error."""
    problem = WholeRunProblem(swum([{}] * 4, FEW, seconds=6.0), paths=PATHS)
    whole = fit(problem.settled(problem.start, problem.default_noise()), rounds=2)
    kept = whole.problem.some([0, 1, 2])
    part = refit(WHOLE, whole, kept)
    own = {"refit_noise": False, "iterations": 10, "tolerance": 1e-3}
    without = fit(kept, whole.effects, whole.point, whole.noise, **own)
    sd = np.sqrt(np.diag(without.covariance))
    assert np.abs((without.estimates - whole.estimates) / sd).max() > 0.05
    np.testing.assert_allclose(part.estimates / sd, without.estimates / sd, atol=0.03)
