"""What an overhead camera cannot see of a fish that swims level stays at its prior."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.identification import SeriesProblem
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.probes import causes_of
from tests.identification.synthetic import Setup, simulate

UNSEEN = ("inertia.rest[1]", "body.rotational_damping[1]", "body.area[2]", "weight_block.d2")
PLANE = ("x", "y", "yaw")


def problem(channels=PLANE, block=0.0):
    data = simulate(Setup(channels=channels, duration=4.0))
    runs = []
    for run in data.runs:
        values = run.commands.values.copy()
        values[:, 3:] = block
        runs.append(replace(run, commands=CommandSteps(run.commands.times_s, values)))
    return SeriesProblem(replace(data, runs=tuple(runs)))


def test_what_a_camera_overhead_cannot_see_is_neither_free_nor_blamed():
    level = problem()
    ids = {cause.id for cause in causes_of(level)}
    assert not {*UNSEEN} & {*level.baseline.paths}
    assert not {Coefficient(path) for path in UNSEEN} & ids
    assert Coefficient("inertia.rest[2]") in ids


@pytest.mark.parametrize("other", [{"block": 0.01}, {"channels": (*PLANE, "roll")}])
def test_it_is_free_where_the_block_moves_or_roll_is_measured(other):
    assert {*UNSEEN} <= {*problem(**other).baseline.paths}


def test_buoyancy_follows_the_mass():
    baseline = problem().baseline
    values = baseline.values(np.random.default_rng(0).standard_normal((len(baseline), 20)))
    mass, buoyancy = (baseline.paths.index(f"mass.{n}") for n in ("total", "buoyancy"))
    assert np.ptp(values[mass]) > 0.01 * baseline.mean[mass]
    trim = values[buoyancy] - values[mass]
    np.testing.assert_allclose(trim, baseline.mean[buoyancy] - baseline.mean[mass], atol=1e-6)
    assert np.ptp(problem(block=0.01).baseline.values(np.eye(38))[buoyancy]) > 1e-4
