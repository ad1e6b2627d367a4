"""A tail far out of step with its command is found from a grid of sizes, and from nothing less."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification import SeriesProblem, fit
from fish_env.identification.runs import FREQUENCY
from fish_env.inference.estimate.coarse_fit import CoarseFitter
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import causes_of, phase_grid
from fish_env.inference.screening import screen
from fish_env.inference.starts import starts
from tests.identification.synthetic import Setup, simulate

SCALE = EffectParameterId("frequency_scale", "scale")
DETUNING = sorted(
    name for name, effect in catalogue().items() if effect.diagnosed and phase_grid(effect, 60.0)
)


def out_of_step(scale):
    """Half a minute of a tail that beats so many times as often as it is told."""
    data = simulate(Setup(runs=2, duration=30.0))
    runs = []
    for run in data.runs:
        told = run.commands.values.copy()
        told[:, FREQUENCY] /= scale
        runs.append(replace(run, commands=replace(run.commands, values=told)))
    return replace(data, runs=tuple(runs))


@pytest.fixture(scope="module", params=[0.915, 0.96, 1.045, 1.08])
def case(request):
    """The scale, and a baseline fitted without it."""
    return request.param, fit(
        SeriesProblem(out_of_step(request.param)), refit_noise=False, iterations=2
    )


def sketched(base):
    (cause,) = (c for c in causes_of(base.problem) if c.id == "frequency_scale")
    signal = screen(base, [cause], np.random.default_rng(0)).best()[0]
    return CoarseFitter(base).coarse_fit(("frequency_scale",), (), starts(base, signal))


def test_a_tail_far_out_of_step_is_put_in_step(case):
    scale, base = case
    assert sketched(base).point.effects[SCALE] == pytest.approx(scale, abs=1e-3)


class Ungridded(SeriesProblem):
    """A problem without starting grids."""

    def starting_grid(self, name):
        return ()


def test_the_probes_alone_do_not_lead_there(case):
    scale, base = case
    without = replace(base, problem=Ungridded(base.problem.dataset))
    assert sketched(without).point.effects[SCALE] != pytest.approx(scale, abs=1e-2)


@pytest.mark.parametrize("name", DETUNING)
def test_the_grid_is_dense_and_lies_on_both_sides(name):
    effect, length, frequency = catalogue()[name], 30.0, 2.0
    (size,) = effect.switching
    values = [probe[size.name] for probe in phase_grid(effect, frequency * length)]
    beats = {"frequency_scale": length, "battery_sag": 0.5 * length**2}[name] * frequency
    assert np.diff(values).max() * beats < 0.35
    assert min(values) <= size.plausible[0] if size.neutral > 0.0 else min(values) < 0.0
    assert max(values) >= size.plausible[1]
    assert size.neutral not in values


def test_only_what_detunes_gets_a_grid_and_no_run_is_too_long_for_one():
    assert DETUNING == ["battery_sag", "frequency_scale"]
    assert phase_grid(catalogue()["beat_load"], 60.0) == (), (
        "two numbers; order tracking finds them"
    )
    assert phase_grid(catalogue()["servo_lag"], 60.0) == ()
    assert len(phase_grid(catalogue()["frequency_scale"], 1e5)) == 96


def test_beats_are_counted_as_commanded():
    (run,) = SeriesProblem(simulate(Setup(runs=1, duration=8.0))).runs
    assert run.beats == pytest.approx(run.command_values[-8:, FREQUENCY].sum())
    assert run.until(4.0).beats == pytest.approx(run.command_values[-8:-4, FREQUENCY].sum())
