"""The test of what is left, on residuals that answer linearly to a wrench."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification.generic_forces import generic_forces, regressors
from fish_env.identification.noise import disturbance_range
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.open_loop import without_feedback
from fish_env.identification.runs import RunData
from fish_env.inference.adequacy import Adequacy, Misfit, adequacy, implausible_estimates
from fish_env.inference.estimate.free import Linearised
from fish_env.inference.hypotheses import Coefficient, EffectParameterId
from fish_env.inference.problem import Point, Problem
from fish_env.params import load_fish
from tests.inference.stated import Stated, coefficients, fit_of

SAMPLES = 400
UNIT = np.repeat([1e-3, 1e-5], 3)


def swimming(rng):
    """A run and its filtered states: smooth random motion about level."""
    clock = np.arange(SAMPLES) / 25.0
    waves = rng.uniform(0.1, 0.6, 20)
    states = np.array([np.sin(2 * np.pi * f * clock + i) for i, f in enumerate(waves)]).T
    states[:, 3:7] *= 0.1
    states[:, 3] = 1.0
    states[:, 3:7] /= np.linalg.norm(states[:, 3:7], axis=1)[:, None]
    states[:, 13] = 8.0 * clock
    run = RunData(
        id="r01", condition=None, clock=clock, substeps=np.ones(SAMPLES, np.int64),
        fresh=np.zeros(SAMPLES, bool), command_times=np.arange(0.0, 16.0, 1.5),
        command_values=rng.uniform(0.1, 0.6, (11, 5)), measured=np.zeros((SAMPLES, 6)),
        state0=states[0, :18], covariance0=np.eye(19), phase_known=True,
    )  # fmt: skip
    return run, replace(without_feedback(run), states=states)


class Answering(Problem):
    """A problem in which each direction of a generic force moves one of six channels."""

    def __init__(self, run, filtered):
        self.baseline, self.known = coefficients(()), {}
        self.forces = generic_forces([run], [filtered], ("z",))

    def disturbance_at_limit(self, noise):
        return disturbance_range(load_fish("zheng-2021-a")).left_by(noise)

    def generic_terms(self, fit):
        return self

    @property
    def columns(self):
        return self.forces.columns

    def words(self, column):
        return self.forces.words(column)

    def swings(self, column):
        return self.forces.swings(column)

    def unit(self, column):
        return UNIT[column % 6]

    def changes(self, columns):
        out = np.zeros((len(columns), SAMPLES, 6))
        for lane, column in enumerate(columns):
            function, direction = divmod(column, 6)
            out[lane, :, direction] -= self.forces.bases[0][:, function]
        return out.reshape(len(out), -1).T


QUIET = NoiseModel(np.ones(6), 3e-3, 1e-4, 1.0)


def fit_with(missing, seed=0, noise=QUIET):
    """A fit whose residuals hold noise and a missing wrench: (function, channel, size).

    A size may be a function of time.
    """
    rng = np.random.default_rng(seed)
    run, filtered = swimming(np.random.default_rng(1))
    residuals = rng.standard_normal((SAMPLES, 6))
    for function, channel, size in missing:
        basis = regressors(run, filtered)[function]
        sizes = size(run.clock) if callable(size) else size
        residuals[:, channel] += sizes * basis / np.sqrt(np.mean(basis**2))
    flat = residuals.ravel()
    lin = Linearised(flat, np.zeros((len(flat), 0)), np.zeros(len(flat), np.int64),
                     np.repeat(run.clock, 6))  # fmt: skip
    problem = Answering(run, filtered)
    return fit_of(problem, noise=noise, linearised=lin, filtered=[filtered])


def test_noise_alone_reaches_the_floor():
    reached = [adequacy(fit_with([], seed), np.random.default_rng(0)).reached for seed in range(3)]
    assert all(reached)


def test_a_disturbance_that_no_tank_makes_is_a_misfit():
    strong = fit_with([], noise=NoiseModel(np.ones(6), 0.5, 1e-4, 1.0))
    answer = adequacy(strong, np.random.default_rng(0))
    assert not answer.reached
    assert "force" in answer.implausible[0]


@pytest.mark.parametrize(
    ("function", "channel", "direction"),
    [("depth", 2, "heave"), ("cos yaw", 5, "yaw"), ("beat speed^2", 0, "surge")],
)
def test_a_missing_wrench_is_found_with_what_it_depends_on(function, channel, direction):
    found = adequacy(fit_with([(function, channel, 0.6)]), np.random.default_rng(0))
    assert not found.reached
    assert found.misfits[0].direction == direction
    assert function in [m.function for m in found.misfits if m.direction == direction]
    unit = UNIT[channel]
    best = next(m for m in found.misfits if m.function == function)
    assert best.size == pytest.approx(0.6 * unit, rel=0.4)


def test_what_depends_on_depth_is_the_same_at_one_depth_in_all_runs():
    run, filtered = swimming(np.random.default_rng(1))
    below = replace(filtered, states=filtered.states + 0.5 * (np.arange(20) == 2))
    forces = generic_forces([run, run], [filtered, below], ("z",))
    column = forces.names.index("depth")
    upper, lower = (basis[:, column] * forces.scale[column] for basis in forces.bases)
    np.testing.assert_allclose(lower - upper, 0.5)


def turning(size):
    """A size that changes its sign after half of a run."""
    return lambda clock: size * np.where(clock < 8.0, 1.0, -1.0)


def test_a_wrench_whose_size_comes_and_goes_is_found():
    missing = [("u|u|", 5, turning(0.7))]
    found = adequacy(fit_with(missing), np.random.default_rng(0))
    assert not found.reached
    assert not found.slight
    first = found.misfits[0]
    assert (first.direction, first.changing) == ("yaw", True)
    own = next(m for m in found.misfits if m.function == "u|u|" and m.changing)
    assert own.size == pytest.approx(0.7 * UNIT[5], rel=0.4)


def test_what_swings_with_the_tail_may_change():
    """Its size follows the beat: small errors of the drive would show as such wrenches."""
    missing = [("cos 3 phase", 5, turning(0.7))]
    found = adequacy(fit_with(missing), np.random.default_rng(0))
    assert not any(m.changing and "phase" in m.function for m in found.misfits)


def test_a_steady_wrench_is_not_said_to_change():
    found = adequacy(fit_with([("depth", 2, 0.6)]), np.random.default_rng(0))
    assert not any(m.changing for m in found.misfits)


def test_a_wrench_below_the_noise_is_left_alone():
    assert adequacy(fit_with([("depth", 2, 0.02)]), np.random.default_rng(0)).reached


SLIGHT = Adequacy(False, -11.0, (Misfit("u", "surge", -12.0, 1e-3),))


@pytest.mark.parametrize("gain", [-3.0, 0.0])
def test_what_foretells_nothing_elsewhere_and_may_be_chance_is_taken_for_it(gain):
    judged = SLIGHT.judged(gain)
    assert judged.reached
    assert judged.refuted == gain


@pytest.mark.parametrize(
    ("left", "gain"),
    [
        (SLIGHT, 0.1),  # the other runs ask for it too
        (replace(SLIGHT, misfits=(Misfit("u", "surge", -22.5, 1e-3),)), -3.0),  # no chance
        (replace(SLIGHT, implausible=("a hull without lift",)), -3.0),
        (replace(SLIGHT, reached=True), -3.0),
    ],
)
def test_all_else_stays_as_it_is(left, gain):
    assert left.judged(gain) is left


def named(
    effects=(), released=(), z=0.0, interval=(0.0, 0.0), at_bounds=(),
    paths=("tail.area", "mass.total"),
):  # fmt: skip
    """A fit with all parameters of its effects in an interval, and a coefficient z off."""
    problem = Stated(lambda z, effects: np.zeros((1, 1)), catalogue().values(), paths)
    values = dict.fromkeys(problem.neutral(effects), sum(interval) / 2)
    point, intervals = Point(np.array([z, 0.0]), values), dict.fromkeys(values, interval)
    released, at_bounds = (tuple(map(Coefficient, paths)) for paths in (released, at_bounds))
    sample = np.zeros(1)
    slopes = np.ones((1, 2 + len(values)))  # all that is free moves it
    lin = Linearised(sample, slopes, sample.astype(np.int64), sample)
    told = {"at_bounds": at_bounds, "profiles": intervals, "linearised": lin}
    return fit_of(problem, effects, released, point, **told)


def test_a_coefficient_far_outside_its_prior_is_no_explanation():
    assert implausible_estimates(named(released=("tail.area",), z=6.0)) == ()
    (said,) = implausible_estimates(named(released=("tail.area",), z=-57.0))
    assert "tail.area" in said.words
    assert implausible_estimates(named(released=("mass.total",), z=-57.0)) == ()
    trimmed = named(released=("mass.buoyancy",), z=19.0, paths=("mass.buoyancy", "mass.total"))
    assert implausible_estimates(trimmed) == ()  # a buoyancy_offset may be as large


def test_beside_an_effect_a_coefficient_has_to_be_nearer():
    """A slip in the fish's file is no stranger; what helps an effect out is."""
    wave = {"effects": ("wave",), "interval": (0.1, 0.2)}
    assert implausible_estimates(named(released=("tail.area",), z=7.1)) == ()
    (said,) = implausible_estimates(named(released=("tail.area",), z=7.1, **wave))
    assert "tail.area 7" in said.words
    assert implausible_estimates(named(released=("tail.area",), z=4.5, **wave)) == ()


def test_a_coefficient_at_the_end_of_what_physics_allows_is_no_explanation():
    """A hull without lift makes up for something else."""
    stuck = named(released=("tail.area",), z=-6.0, at_bounds=("tail.area",))
    (said,) = implausible_estimates(stuck)
    assert "tail.area" in said.words
    assert implausible_estimates(named(z=-4.9, at_bounds=("tail.area",))) == ()  # nothing claims it


@pytest.mark.parametrize(
    ("effect", "interval", "believed"),
    [
        ("hull_compression", (0.002, 0.004), True),
        ("hull_compression", (-0.001, 0.002), True),  # may be of the right sign
        ("hull_compression", (-0.02, -0.01), False),  # a hull that swells with depth
        ("hull_compression", (0.2, 0.3), False),
        ("frequency_scale", (0.8, 0.85), True),
        ("servo_rate_limit", (1.0, 1.5), True),
        ("servo_rate_limit", (0.01, 0.05), False),
        ("tether", (0.01, 0.03), True),
        ("tether", (8.0, 9.0), False),  # anchored, and as stiff, far beyond any tank
    ],
)
def test_an_effect_needs_a_sign_and_size_that_it_can_have(effect, interval, believed):
    assert (implausible_estimates(named(effects=(effect,), interval=interval)) == ()) is believed


@pytest.mark.parametrize("depth", [3700.0, 0.5])
def test_a_shape_that_does_nothing_where_it_is_infinite_is_never_too_large(depth):
    """Data may hardly tell a deep tank from the sea."""
    found = named(effects=("wave",))
    values = {**found.point.effects, EffectParameterId("wave", "tank_depth"): depth}
    assert implausible_estimates(replace(found, point=Point(found.point.z, values))) == ()


def test_a_shape_that_is_finite_may_be_too_large():
    found = named(effects=("wave",))
    values = {**found.point.effects, EffectParameterId("wave", "frequency"): 9.0}
    (said,) = implausible_estimates(replace(found, point=Point(found.point.z, values)))
    assert "frequency" in said.words


@pytest.mark.parametrize(("share", "believed"), [(1.0, True), (0.0, False)])
def test_a_shape_beside_which_the_simulation_diverges_is_not_believed(share, believed):
    """Its slope is zero then, though it is of a size at which it should act."""
    found = named(effects=("wave",))
    id = EffectParameterId("wave", "frequency")
    low, high = next(p.plausible for p in catalogue()["wave"].parameters if p.name == id.name)
    lin = found.linearised
    slopes = lin.slopes.copy()
    slopes[:, found.ids.index(id)] *= share
    values = {**found.point.effects, id: 0.5 * (low + high)}
    point = Point(found.point.z, values)
    lost = replace(found, point=point, linearised=replace(lin, slopes=slopes))
    assert (implausible_estimates(lost) == ()) is believed


@pytest.mark.parametrize("more", [(), ("z",), ("q",)], ids=["camera", "depth", "gyro"])
def test_what_no_channel_shows_is_not_blamed(more):
    """A camera overhead sees neither depth nor inclination; the filter guesses them."""
    run, filtered = swimming(np.random.default_rng(1))
    forces = generic_forces([run], [filtered], ("x", "y", "yaw", "tail_angle", *more))
    functions, directions = map(set, zip(*map(forces.words, forces.columns), strict=True))
    assert {"u", "v", "u r", "sin 1 phase"} <= functions
    assert {"surge", "sway", "yaw"} <= directions
    upright = {"heave", "roll", "pitch"}, {"w", "u w", "depth", "sin pitch"}
    for blamed, unseen in zip((directions, functions), upright, strict=True):
        assert blamed & unseen == (unseen if more else set())
    again = forces.along([run], [filtered])
    assert again.columns.tolist() == forces.columns.tolist()
