"""Where sketches of a cause begin, and what becomes of one that has seen nothing."""

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification import SeriesProblem
from fish_env.inference.estimate.fit import fit
from fish_env.inference.explanation import Explanation
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import causes_of
from fish_env.inference.search import refits
from fish_env.inference.starts import probed
from tests.identification.synthetic import Setup, simulate
from tests.inference.stated import SIZE, Stated, cause_of, effect, signal_of, size_of

PROBLEM = SeriesProblem(simulate(Setup(runs=1, duration=2.0)))
CAUSES = {cause.id: cause for cause in causes_of(PROBLEM) if cause.is_effect}


@pytest.mark.parametrize("name", sorted(CAUSES))
def test_no_sketch_begins_where_the_effect_is_off(name):
    switches = [p for p in catalogue()[name].parameters if not p.shapes]
    begun = probed(PROBLEM, signal_of(CAUSES[name], 1.0))
    for values in begun:
        assert any(values[EffectParameterId(name, p.name)] != p.neutral for p in switches)


def test_a_clock_that_may_be_fast_or_slow_is_tried_both_ways():
    begun = probed(PROBLEM, signal_of(CAUSES["clock_scale"], 1.0))
    scales = [values[EffectParameterId("clock_scale", "scale")] for values in begun]
    assert min(scales) < 1.0 < max(scales)
    late = probed(PROBLEM, signal_of(CAUSES["servo_lag"], 1.0))
    assert all(values[EffectParameterId("servo_lag", "time_constant")] > 0.0 for values in late)


def late(size):
    """Nothing up to a size: no slope leads away from there."""
    return max(size - 0.05, 0.0)


@pytest.mark.parametrize(
    ("sketched", "other", "estimate"),
    [
        (-2.0, 10.0, 3.0),  # the few runs show the contrary, and their sketch ends switched off
        (2.6, 2.6, 0.03),  # the sketch gets where the estimate from all runs would not lead
    ],
)
def test_a_sketch_that_ends_switched_off_gives_way_to_the_estimate_from_all_runs(
    sketched, other, estimate
):
    wanted = np.array([sketched, other, sketched])  # a sketch uses the first and the last

    def residuals(z, effects):
        off = late(effects[size_of("drag")]) - wanted
        return np.column_stack([off, np.full(len(off), z[0])])

    drag = effect("drag", lower=0.0)
    problem, cause = Stated(residuals, [drag]), cause_of(drag)
    small = cause.probes[0][0][SIZE]
    present = Explanation((), fit(problem, refit_noise=False))
    signal = signal_of(cause, (estimate / small) ** 2)
    (best,), _ = refits(present, [signal], lambda step: None)
    assert best.fit.point.effects[size_of("drag")] == pytest.approx(0.05 + wanted.mean(), abs=0.01)
