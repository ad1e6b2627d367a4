"""Steps of the simulation are fine where the tail may be quick, and that is fine enough."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps
from fish_env.identification.command_jumps import SWITCH_S
from fish_env.identification.open_loop import errors
from fish_env.identification.runs import FINER
from fish_env.identification.series import SeriesProblem
from fish_env.identification.tail_drive import tail_drive
from fish_env.inference.effort import QUICK
from fish_env.inference.estimate.again import following, refined, to_search
from fish_env.inference.estimate.coarse_fit import CoarseFit
from fish_env.inference.estimate.fit import fit
from fish_env.inference.estimate.free import Free, linearise
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.probes import causes_of, effect_values
from fish_env.inference.problem import Point
from tests.identification.synthetic import PATHS, Setup, simulate

LAG = {EffectParameterId("servo_lag", "time_constant"): 0.013}
LIMIT = {EffectParameterId("servo_rate_limit", "rate"): 2.0}
TORQUE = {EffectParameterId("servo_torque_limit", "torque"): 0.01}


@pytest.fixture(scope="module")
def dataset():
    return simulate(Setup(runs=1, duration=4.0))


def predicted(problem, effects):
    point = Point(np.zeros(len(problem.baseline)), effects)
    return errors(problem, point, noise_of(problem))[0]


def noise_of(problem):
    return Setup(channels=problem.channels).noise


def off(dataset, effects, change=lambda problem: problem):
    """Largest error of the steps, in standard deviations of the sensors."""
    problem = change(SeriesProblem(dataset))
    exact = SeriesProblem(dataset, dt=2e-4)
    difference = predicted(problem, effects) - predicted(exact, effects)
    return np.nanmax(np.abs(difference / problem.sensor_sd))


def without_fine_steps(problem):
    plain = [replace(run, substeps=np.full_like(run.substeps, 4)) for run in problem.runs]
    return problem.with_runs(plain)


def test_steps_are_fine_after_a_switch_and_plain_elsewhere(dataset):
    run = SeriesProblem(dataset).runs[0]
    span = np.diff(run.clock) / run.substeps[1:]
    since = run.clock[:-1, None] - run.command_times
    fresh = ((since > -0.04 + 1e-9) & (since < SWITCH_S - 1e-6)).any(axis=1)
    np.testing.assert_array_equal(span <= 0.01 / FINER + 1e-9, fresh)
    assert span.max() <= 0.01 + 1e-9
    assert 0.0 < fresh.mean() < 0.2


@pytest.mark.parametrize("effects", [LAG, {}], ids=["lag", "nothing"])
def test_the_steps_get_less_wrong_than_the_sensors(dataset, effects):
    assert off(dataset, effects) < 1.0


CORNERS = {
    "servo_rate_limit": {"rate": 2.5},
    "servo_backlash": {"gap": 0.06},
    "servo_delay": {"delay": 0.0333},
    "angle_limit": {"upper": 0.3},
    "tail_asymmetry": {"ratio": 0.1},
}
"""Effects by which the tail's rate jumps, at sizes that part many steps."""


@pytest.mark.parametrize("name", CORNERS)
@pytest.mark.parametrize("long", [False, True])
def test_the_likelihood_is_that_of_much_shorter_steps_where_the_rate_jumps(dataset, name, long):
    """Long steps too: a lag of theirs would be worth more. Corners in equal steps cost hundreds."""
    values = {EffectParameterId(name, key): value for key, value in CORNERS[name].items()}
    usual, exact = SeriesProblem(dataset), SeriesProblem(dataset, dt=5e-4)
    point, noise = Point(np.zeros(len(usual.baseline)), values), noise_of(usual)
    problems = (usual.with_long_steps() if long else usual, exact)
    shown, right = (p.filtered(point, noise)[0].log_likelihood for p in problems)
    assert shown == pytest.approx(right, abs=12.0 if long else 1.0)


@pytest.mark.parametrize("finer", [1, 4])
def test_a_limit_that_the_tail_never_meets_changes_no_likelihood(finer):
    """Also where the filter turns the phase of the tail at every sample, as a walk lets it.

    A tail that was left behind by such a turn would race after its command at its largest rate.
    """
    beating = np.tile([0.1, 0.4, 1.6, 0.0, 0.0], (4, 1))
    problem = SeriesProblem(simulate(Setup(runs=1, duration=4.0), beating))
    runs = [replace(run, substeps=finer * run.substeps) for run in problem.runs]
    noise = replace(noise_of(problem), phase_sd=0.03)

    def likelihood(effects):
        point = Point(np.zeros(len(problem.baseline)), effects)
        (run,) = problem.with_runs(runs).filtered(point, noise)
        return run.log_likelihood

    rate = EffectParameterId("servo_rate_limit", "rate")
    plain, unmet, met = (likelihood(e) for e in ({}, {rate: 16.0}, {rate: 3.8}))
    assert unmet == pytest.approx(plain, abs=1e-3)
    assert met < plain - 30.0


def test_plain_steps_would_not_do():
    """After a switch of the block, which reacts on the hull."""
    block = np.tile([[0.1, 0.3, 1.5, 0.02, 0.5], [0.1, 0.3, 1.5, -0.02, -0.5]], (2, 1))
    moved = simulate(Setup(runs=1, duration=4.0), block)
    reaction = {EffectParameterId("block_reaction", "scale"): 1.0}
    assert off(moved, reaction, without_fine_steps) > 2.0 * off(moved, reaction)


def test_the_longer_steps_of_a_first_look_will_do(dataset):
    exact, coarse = SeriesProblem(dataset, dt=2e-4), SeriesProblem(dataset, dt=QUICK.step_s)
    assert coarse.longest_step > 1.3 * SeriesProblem(dataset).longest_step
    difference = predicted(coarse, {}) - predicted(exact, {})
    assert np.nanmax(np.abs(difference / exact.sensor_sd)) < 1.0


def told(problem, filtered, settings):
    """What settings of effects change in the whitened innovations (n, D)."""
    noise, count = noise_of(problem), len(problem.baseline)
    rows = []
    for name, setting in settings:
        neutral = problem.neutral([name])
        values = {**neutral, **effect_values(problem, name, setting)}
        lanes = {path: np.array([neutral[path], values[path]]) for path in neutral}
        before, after = problem.innovations(np.zeros((count, 2)), lanes, noise, filtered)
        rows.append(after - before)
    return np.array(rows)


def unlikeness(dataset, in_long_steps=SeriesProblem.with_long_steps):
    """Effect -> largest error of what it changes, as a share, for steps to compare causes with."""
    problem, exact = SeriesProblem(dataset), SeriesProblem(dataset, dt=1e-3)
    filtered = problem.filtered(problem.start, noise_of(problem))
    settings = [
        (cause.id, setting)
        for cause in causes_of(problem) if cause.is_effect
        for alternative in cause.probes for setting in alternative
    ]  # fmt: skip
    long, fine = (told(p, filtered, settings) for p in (in_long_steps(problem), exact))
    visible = np.linalg.norm(fine, axis=1)
    shares = np.linalg.norm(long - fine, axis=1) / np.maximum(visible, 1e-9)
    worst = {}
    for (name, _), share, size in zip(settings, shares, visible, strict=True):
        if size > 0.1:  # of a sensor's noise, all samples together
            worst[name] = max(worst.get(name, 0.0), float(share))
    return problem, worst


@pytest.mark.slow
@pytest.mark.long
def test_causes_look_the_same_in_long_steps(dataset):
    problem, worst = unlikeness(dataset)
    cornered = [worst[name] for name in worst if problem.is_nonsmooth([name])]
    assert len(worst) > 20
    assert len(cornered) >= 2
    assert np.median([*worst.values()]) < 1e-3
    assert max(worst.values()) < 0.1


@pytest.mark.slow
@pytest.mark.long
def test_still_longer_steps_would_not_do(dataset):
    def longer(problem):
        fastest = problem.model.longest_step()
        return problem.with_runs([run.in_long_steps(fastest, 0.04) for run in problem.runs])

    assert not max(unlikeness(dataset, longer)[1].values()) < 1.0


def test_long_steps_are_those_of_the_usual_freedoms_and_never_finer(dataset):
    usual, coarse = SeriesProblem(dataset), SeriesProblem(dataset, dt=0.04)
    long = usual.with_long_steps()
    assert long.longest_step == pytest.approx(2.0 * usual.longest_step)
    assert long.freedoms(["servo_lag"]) == usual.freedoms(["servo_lag"])
    pairs = zip(coarse.with_long_steps().runs, coarse.runs, strict=True)
    assert all((a.substeps <= b.substeps).all() for a, b in pairs)


def test_what_is_off_at_infinity_goes_as_far_as_steps_follow_it(dataset):
    """Beyond, a tail that hardly bends diverges, and a fit would run there to do nothing."""
    problem = SeriesProblem(dataset)
    (quick,) = (f for f in problem.freedoms(["tail_flexibility"]) if f.id.name != "damping_ratio")
    known = problem.known["tail_flexibility"]
    assert known.is_followed({**known.neutral, quick.id.name: 0.99 * quick.upper}, problem.dt)
    assert not known.is_followed({**known.neutral, quick.id.name: 1.01 * quick.upper}, problem.dt)
    (shorter,) = (
        f for f in SeriesProblem(dataset, dt=0.005).freedoms(["tail_flexibility"])
        if f.id == quick.id
    )  # fmt: skip
    assert shorter.upper == pytest.approx(2.0 * quick.upper, rel=1e-3)
    (limit,) = problem.freedoms(["servo_rate_limit"])
    assert limit.upper == np.inf
    (lag,) = problem.freedoms(["servo_lag"])
    assert lag.upper == problem.known["servo_lag"].parameters[0].upper


def test_estimates_to_be_published_are_made_in_the_usual_steps(dataset):
    """However often a fit went to long steps, and on a part of its runs."""
    usual = SeriesProblem(dataset)
    long = usual.with_long_steps().with_long_steps().until(2.0)
    assert long.is_coarse
    assert not usual.is_coarse
    again = long.in_usual_steps()
    assert not again.is_coarse
    assert again.runs[0].substeps.tolist() == usual.until(2.0).runs[0].substeps.tolist()


def test_a_fit_in_long_steps_is_refined(dataset):
    problem = SeriesProblem(dataset, paths=(PATHS[0],)).with_long_steps()
    quick = fit(problem, rounds=1)
    found = refined(quick)
    exact = fit(SeriesProblem(dataset, paths=(PATHS[0],)), noise=quick.noise, rounds=1)
    sd = np.sqrt(exact.covariance[0, 0])
    assert found.problem.longest_step == pytest.approx(0.5 * problem.longest_step)
    assert found.estimates[0] == pytest.approx(exact.estimates[0], abs=0.05 * sd)
    assert refined(found) is found


@pytest.mark.parametrize(("lag", "finer"), [(0.005, 2.0), ("shortest", 2.0), (0.03, 1.0)])
def test_a_search_goes_on_in_steps_that_can_have_its_lag(dataset, lag, finer):
    usual = SeriesProblem(dataset, paths=(PATHS[0],)).with_drive(tail_drive({}, uneven=True))
    long, effects = to_search(usual), ("servo_lag",)
    assert long.longest_step == pytest.approx(2.0 * usual.longest_step)
    (gap,) = Free(long, effects, ()).bounds.gaps
    value = gap.least if lag == "shortest" else lag
    at = Point(np.zeros(1), {EffectParameterId("servo_lag", "time_constant"): value})
    begin = CoarseFit(effects, (), at, 0.0)
    for searched in (to_search(usual, begin), to_search(long, begin), following(long, begin)):
        assert searched.longest_step == pytest.approx(long.longest_step / finer)
        held = {"noise": noise_of(usual), "refit_noise": False, "iterations": 0}
        assert fit(searched, effects, at, **held).point.effects == at.effects
    assert following(usual, begin) is usual


def gliding(dataset):
    """Commands that move without a jump, told with every sample as a logger does."""
    (run,) = dataset.runs
    t = run.time_s
    swing = np.sin(2.0 * np.pi * 0.2 * t)
    commands = CommandSteps(t, np.column_stack([
        0.3 * swing, 0.35 + 0.1 * swing, 1.5 + 0.4 * swing, 0.02 * swing, 0.5 * swing
    ]))  # fmt: skip
    return replace(dataset, runs=(replace(run, commands=commands),))


@pytest.mark.parametrize(
    "effects",
    [LAG, {}, {EffectParameterId("block_reaction", "scale"): 1.0}],
    ids=["lag", "nothing", "block"],
)
def test_commands_that_glide_need_no_fine_steps(dataset, effects):
    data = gliding(dataset)
    steps = SeriesProblem(data).runs[0].substeps
    first = SeriesProblem(data).runs[0].clock <= 0.04
    assert steps[~first].max() == 4
    assert off(data, effects) < 0.2


def along_a_clock(problem):
    """-2 log likelihood as a run's clock moves through half a sample, a tenth of one each time."""
    limit = dict.fromkeys(LIMIT, 8.0)
    point, noise = Point(problem.start.z, limit), noise_of(problem)
    number = [v.name for v in problem.variations].index("clock_offset")
    sample = float(np.median(np.diff(problem.dataset.runs[0].time_s)))
    values = []
    for share in np.arange(0.0, 0.55, 0.1):
        own = np.zeros((1, len(problem.variations)))
        own[0, number] = share * sample
        moved = problem.with_variation(own, point, noise)
        values.append(-2.0 * moved.filtered(point, noise)[0].log_likelihood)
    return np.array(values)


@pytest.mark.parametrize(("long", "most"), [(False, 1.0), (True, 5.0)])
def test_steps_add_no_bends_to_a_likelihood_along_a_clock(dataset, long, most):
    """A clock moves commands and corners through the steps, which must not look like evidence.

    With the mean of the commands in a step that they switch in, bends were 850 and 1,950.
    """
    problem = SeriesProblem(dataset)
    shown = along_a_clock(problem.with_long_steps() if long else problem)
    exact = along_a_clock(SeriesProblem(dataset, dt=1e-3))
    assert np.ptp(exact) > 1e4
    assert np.abs(np.diff(shown - exact, 2)).max() < most


class AnySmallest(SeriesProblem):
    """A problem that takes every lag for one that its steps follow."""

    def freedoms(self, names):
        return tuple(replace(f, least=-np.inf) for f in super().freedoms(names))


def likeness_where_it_is_off(dataset, effect, kind=SeriesProblem):
    """Cosine between the slope by a lag that is off and what a lag does that steps follow."""
    problem = kind(dataset)
    free, noise = Free(problem, (effect,), ()), noise_of(problem)
    (path,) = free.ids[free.count :]
    nothing = Point(np.zeros(free.count), {path: 0.0})
    filtered = problem.filtered(nothing, noise)
    free.suit_steps(1e12 * np.eye(len(free.ids)))  # as if the data told the smallest change
    slope = linearise(problem, free, free.pack(nothing), noise, filtered).slopes[:, -1]
    sizes = {path: np.array([0.0, 0.02])}
    before, after = problem.innovations(np.zeros((free.count, 2)), sizes, noise, filtered)
    lengths = np.linalg.norm(slope) * np.linalg.norm(after - before)
    return slope @ (after - before) / max(lengths, 1e-12)


@pytest.mark.parametrize("effect", ["servo_lag", "wake_memory"])
def test_a_lag_that_is_off_can_be_switched_on(dataset, effect):
    assert likeness_where_it_is_off(dataset, effect) > 0.8
    # Steps too long for it diverge.
    assert likeness_where_it_is_off(dataset, effect, AnySmallest) < 0.2


def test_only_what_is_too_quick_takes_other_steps(dataset):
    problem = SeriesProblem(dataset)
    free = Free(problem, problem.known, ())
    for side in (-1.0, 1.0):
        values = {f.id: 3.0 * side * f.step if f.lower < 0.0 else 2.0 for f in free.freedoms}
        start = free.bounds.clip(free.pack(Point(np.zeros(free.count), values)))
        steps = free.lanes(start)[1]
        np.testing.assert_array_equal(np.abs(steps), free.largest_steps)
    least = {f.id for f in free.freedoms if np.isfinite(f.least)}
    lags = ("servo_lag", "block_lag", "wake_memory")
    quick = {EffectParameterId(name, "time_constant") for name in lags}
    # A flat hull that floats bobs fast.
    assert least == {*quick, EffectParameterId("surface_piercing", "height")}


def test_late_samples_show_the_time_before_the_run():
    """A record that is late by its delay is the prompt record, pushed back."""
    delay, setup = 0.08, Setup(runs=1, duration=3.0, uneven=False)
    data = simulate(setup)
    late = SeriesProblem(data)
    prompt = predicted(late, {})
    shown = predicted(late, {EffectParameterId("sensor_delay", "delay"): delay})
    measured = late.runs[0].measured[: -late.runs[0].most_rows]  # the last ones count for nothing
    samples, rows = round(delay * setup.rate), len(measured)
    shown, prompt = measured - shown[:rows], measured - prompt[:rows]
    np.testing.assert_allclose(shown[samples + 4 :], prompt[4:-samples], atol=2e-3)


@pytest.mark.parametrize(
    ("effect", "distort"),
    [
        (
            {EffectParameterId("position_scale", "scale"): 0.9},
            lambda name, v: 0.9 * v if name in "xyz" else v,
        ),
        (
            {EffectParameterId("depth_bias", "offset"): 0.3},
            lambda name, v: v + 0.3 if name == "z" else v,
        ),
    ],
    ids=["scale", "bias"],
)
def test_a_distortion_of_the_samples_is_undone_at_the_start_too(dataset, effect, distort):
    (run,) = dataset.runs
    moved = {name: v + 2.0 if name == "x" else v for name, v in run.channels.items()}
    shown = {name: distort(name, v) for name, v in moved.items()}
    plain = SeriesProblem(replace(dataset, runs=(replace(run, channels=moved),)))
    distorted = SeriesProblem(replace(dataset, runs=(replace(run, channels=shown),)))
    start = Point(np.zeros(len(plain.baseline)), {})
    expected = plain.filtered(start, noise_of(plain))[0]
    found = distorted.filtered(replace(start, effects=effect), noise_of(distorted))[0]
    np.testing.assert_allclose(found.states[:, :3], expected.states[:, :3], atol=1.5e-3)
    wrong = distorted.filtered(start, noise_of(distorted))[0]
    assert np.abs(wrong.states[:, :3] - expected.states[:, :3]).max() > 0.1
