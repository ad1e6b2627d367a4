"""Where sketches of a cause begin, and what becomes of one that has seen nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification import SeriesProblem
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.probes import Cause, causes_of
from fish_env.inference.problem import Point
from fish_env.inference.search import _coarse_fits
from fish_env.inference.starts import probed
from tests.identification.synthetic import Setup, simulate

PROBLEM = SeriesProblem(simulate(Setup(runs=1, duration=2.0)))
CAUSES = {cause.name: cause for cause in causes_of(PROBLEM) if cause.is_effect}
GAIN, DEPTH = "effects.surface_drag.gain", "effects.surface_drag.depth"


@pytest.mark.parametrize("name", sorted(CAUSES))
def test_no_sketch_begins_where_the_effect_is_off(name):
    switches = [p for p in catalogue()[name].parameters if not p.shapes]
    begun = probed(PROBLEM, SimpleNamespace(cause=CAUSES[name], probe=0))
    for values in begun:
        assert any(values[f"effects.{name}.{p.name}"] != p.neutral for p in switches)


def test_a_clock_that_may_be_fast_or_slow_is_tried_both_ways():
    begun = probed(PROBLEM, SimpleNamespace(cause=CAUSES["clock_scale"], probe=0))
    scales = [values["effects.clock_scale.scale"] for values in begun]
    assert min(scales) < 1.0 < max(scales)
    late = probed(PROBLEM, SimpleNamespace(cause=CAUSES["servo_lag"], probe=0))
    assert all(values["effects.servo_lag.time_constant"] > 0.0 for values in late)


@pytest.mark.parametrize(("reached", "kept"), [(0.0, False), (0.1, True)])
def test_a_sketch_that_ends_switched_off_gives_way_to_the_estimate_from_all_runs(reached, kept):
    estimate = Point(np.zeros(1), {GAIN: 2.0, DEPTH: 0.2})
    ended = CoarseFit(("surface_drag",), (), Point(np.ones(1), {GAIN: reached, DEPTH: 0.005}), 10.0)
    fitter = SimpleNamespace(coarse_fit=lambda *given: ended)
    base = SimpleNamespace(problem=PROBLEM, effects=(), released=())
    signal = SimpleNamespace(cause=Cause("surface_drag", ()))
    ((name, found),) = _coarse_fits(fitter, base, signal, [estimate])
    assert name == "surface_drag"
    assert found.objective == 10.0
    assert found.point is (ended.point if kept else estimate)
