"""Coefficient tables in the place of the analytic curves."""

import numpy as np
import pytest
import yaml

from fish_env.params.io import config_root, load_fish
from fish_env.simulator import Simulator
from tests.physics import checkers
from tests.physics.cases import SWIM, TUMBLE, random_inputs, random_states, swimmer

ANGLES = np.linspace(0.0, np.pi / 2, 181)
RISE, BEND = np.sin(ANGLES) ** 2, np.sin(ANGLES) * np.cos(ANGLES)
BEND[-1] = 0.0
CURVES = {
    "tail.drag": 0.06 + 2.2 * RISE,
    "tail.lift": 2.4 * BEND,
    "body.plane_xz.drag": 0.16 + 1.5 * RISE,
    "body.plane_xz.lift": 1.5 * BEND,
    "body.plane_xz.impact_moment": 0.050 * BEND,
    "body.plane_xy.drag": 0.16 + 1.5 * RISE,
    "body.plane_xy.lift": 1.5 * BEND,
    "body.plane_xy.impact_moment": -0.080 * BEND,
}


def tabulated(folder, curves):
    """Fish A with some of its curves sampled into tables."""
    data = yaml.safe_load((config_root() / "fish" / "zheng-2021-a.yaml").read_text())
    for curve, values in curves.items():
        *groups, name = curve.split(".")
        section = data
        for group in groups:
            section = section[group]
        section[name] = {"table": f"{curve}.csv"}
        rows = np.column_stack([ANGLES, values])
        np.savetxt(folder / f"{curve}.csv", rows, delimiter=",", header="alpha_rad,C", comments="")
    (folder / "tabulated.yaml").write_text(yaml.safe_dump(data))
    return load_fish(folder / "tabulated.yaml")


@pytest.fixture(scope="module")
def all_tables(tmp_path_factory):
    return tabulated(tmp_path_factory.mktemp("all"), CURVES)


def test_fine_tables_of_the_analytic_curves_give_the_analytic_forces(all_tables):
    """All eight curves, states all over: each term agrees, so no curve is read for another."""
    rng = np.random.default_rng(1)
    one, two = Simulator(all_tables), Simulator(swimmer())
    for state, inputs in zip(random_states(rng, 40), random_inputs(rng, 40), strict=True):
        by_table, analytic = (x.wrench_by_term(state, inputs) for x in (one, two))
        for name, wrench in analytic.items():
            # The slope of the lift coefficient over cos(alpha) is the least well resolved.
            scale = 1e-3 * np.abs(wrench).max() + 1e-6
            np.testing.assert_allclose(by_table[name], wrench, atol=scale, err_msg=name)


def test_fine_tables_of_the_analytic_curves_give_the_analytic_path(all_tables):
    """Half a degree between knots leaves a path error far below any tank's measurement."""
    one = Simulator(all_tables).run(SWIM, duration_s=3.0, initial=TUMBLE)
    two = Simulator(swimmer()).run(SWIM, duration_s=3.0, initial=TUMBLE)
    np.testing.assert_allclose(one.states[:, :3], two.states[:, :3], atol=1e-4)


@pytest.mark.parametrize("curve", CURVES)
def test_a_single_table_leaves_the_other_curves_analytic(tmp_path, curve):
    """The other seven terms keep their bits; a doubled table changes the term it belongs to."""
    fish = tabulated(tmp_path, {curve: 2.0 * CURVES[curve]})
    state = random_states(np.random.default_rng(4), 1)[0]
    by_table = Simulator(fish).wrench_by_term(state)
    analytic = Simulator(swimmer()).wrench_by_term(state)
    changed = {name for name in analytic if not np.array_equal(by_table[name], analytic[name])}
    place, kind = curve.rsplit(".", 1)
    term = "impact" if kind == "impact_moment" else f"{place.removeprefix('body.plane_')}_{kind}"
    assert changed == {term}
    ratio = np.linalg.norm(by_table[term]) / np.linalg.norm(analytic[term])
    assert ratio == pytest.approx(2.0, rel=2e-3) or term == "impact"


def test_tables_do_not_break_the_mirror_symmetry(all_tables):
    """Drag is even in alpha, lift and impact moment are odd, at rest and at 90 degrees too."""
    simulator = Simulator(all_tables)
    for velocity in ([0.3, 0.2, 0.0], [0.0, 0.2, 0.1], [-0.3, 0.1, 0.2], [0.0, 0.0, 0.0]):
        state = np.array([0, 0, 0, 1, 0, 0, 0, *velocity, 0, 0, 0], float)
        mirrored = state.copy()
        mirrored[8] *= -1
        one, two = simulator.state_derivative(state), simulator.state_derivative(mirrored)
        signs = np.array([1, -1, 1, -1, 1, -1])
        assert np.all(np.isfinite(one))
        np.testing.assert_allclose(two[7:13], signs * one[7:13], atol=1e-12)


def test_tables_work_in_a_batch(all_tables):
    """A batch of fish with tables moves like the single fish, to the last bit."""

    def build(_, dt, effects):
        return Simulator(all_tables, dt, effects)

    checkers.check_scalar_equals_batch(build, 5)


def test_the_load_of_a_servo_is_that_of_the_tables(all_tables):
    """Without it the servo would feel no water, and turn at its speed without load."""
    weak = {"servo_torque_limit": {"torque": 0.01}}
    paths = [
        Simulator(fish, effects=effects).run(SWIM, duration_s=2.0).states[:, :13]
        for fish, effects in ((all_tables, weak), (swimmer(), weak), (swimmer(), None))
    ]
    assert np.abs(paths[0] - paths[1]).max() < 1e-3 * np.abs(paths[2] - paths[1]).max()
