"""The compiled filter: against a plain one, whiteness, sensitivity, odd data, determinism."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Run
from fish_env.effects import catalogue
from fish_env.effects.extended import build_model
from fish_env.identification import SeriesProblem
from fish_env.identification.jitter import channel_rates
from fish_env.identification.open_loop import errors
from fish_env.identification.phases import settle_phases
from fish_env.inference.estimate.free import Free, linearise
from fish_env.inference.hypotheses import EffectParameterId, effects_of
from fish_env.inference.problem import Point
from fish_env.params import load_fish
from fish_env.sensing import measured_channels
from fish_env.sensing.channels import channels_from_states
from fish_env.sensing.geometry import through_geometry
from tests.identification.synthetic import PATHS, Setup, simulate


def problem_of(setup: Setup, **options) -> SeriesProblem:
    return SeriesProblem(simulate(setup), paths=PATHS, **options)


def moved(state, error):
    """Apply an error state to a base state."""
    result = state.copy()
    result[0:3] += error[0:3]
    w, v = state[3], state[4:7]
    half = 0.5 * error[3:6]
    result[3] = w - v @ half
    result[4:7] = v + w * half + np.cross(v, half)
    result[3:7] /= np.linalg.norm(result[3:7])
    result[7:13] += error[6:12]
    result[13] += error[18]
    return result


def apart(state, other):
    """Error state (without wrench) that leads from one base state to another."""
    w, v = state[3], -state[4:7]
    turn = other[4:7] * w + v * other[3] + np.cross(v, other[4:7])
    gaps = [other[0:3] - state[0:3], 2.0 * turn, other[7:13] - state[7:13]]
    return np.concatenate(gaps), other[13] - state[13]


def seen(state, channels):
    shown = channels_from_states(state[:, None])
    return np.array([shown[name][0] for name in channels])


def plain_filter(problem, noise):
    """The same filter, one step at a time with numpy and differences for every slope."""
    data, record = problem.runs[0], problem.model.record
    model = problem.lean_filter.model
    kernels, record = problem.lean_filter.kernels, model.record.copy()
    state, wrench, p = data.state0.copy(), np.zeros(6), data.covariance0.copy()
    total, white = 0.0, []
    rates = channel_rates(data.clock, data.measured, problem.channels)

    def slope(x, u, d):
        par = record.copy()
        par[-6:, 0] = d
        none = np.zeros((5, 1))
        return kernels.derivative(x[:, None], u[:, None], none, par, np.zeros(1), model.tables)[
            :, 0
        ]

    def advance(x, d, k):
        span = data.clock[k] - data.clock[k - 1]
        h = span / data.substeps[k]
        row = np.searchsorted(data.command_times, data.clock[k - 1] + 1e-9, side="right") - 1
        u = data.command_values[row]
        for _ in range(data.substeps[k]):
            a = slope(x, u, d)
            b = slope(x + 0.5 * h * a, u, d)
            c = slope(x + 0.5 * h * b, u, d)
            x = x + h / 6.0 * (a + 2 * b + 2 * c + slope(x + h * c, u, d))
            x[3:7] /= np.linalg.norm(x[3:7])
        return x

    for k in range(len(data.clock)):
        if k:
            centre = advance(state, wrench, k)
            keep = np.exp(-(data.clock[k] - data.clock[k - 1]) / noise.correlation_s)
            f = np.zeros((19, 19))
            for j in range(19):
                unit = 1e-5 * np.eye(19)[j]
                gap, phase = apart(centre, advance(moved(state, unit), wrench + unit[12:18], k))
                f[:12, j], f[18, j] = gap / 1e-5, phase / 1e-5
            f[12:18, 12:18] = keep * np.eye(6)
            state, wrench, p = centre, keep * wrench, f @ p @ f.T
            p[12:18, 12:18] += np.diag(noise.wrench_variance) * (1.0 - keep**2)
            p[18, 18] += noise.phase_sd**2 * (data.clock[k] - data.clock[k - 1])
        h_rows = np.column_stack(
            [
                (seen(moved(state, s), problem.channels) - seen(moved(state, -s), problem.channels))
                / 2e-6
                for s in 1e-6 * np.eye(19)
            ]
        )
        if np.isnan(data.measured[k]).all():  # before the record says what the servo was told
            white.append(np.zeros(len(problem.channels)))
            continue
        e = data.measured[k] - seen(state, problem.channels)
        s = h_rows @ p @ h_rows.T + np.diag(noise.sensor_sd**2)
        s += noise.jitter_sd**2 * np.outer(rates[k], rates[k])
        gain = p @ h_rows.T @ np.linalg.inv(s)
        white.append(np.linalg.solve(np.linalg.cholesky(s), e))
        total -= 0.5 * (white[-1] @ white[-1] + np.linalg.slogdet(s)[1])
        p = (np.eye(19) - gain @ h_rows) @ p
        change = gain @ e
        state, wrench = moved(state, change), wrench + change[12:18]
    return np.array(white), total


@pytest.mark.parametrize("jitter_sd", [0.0, 0.004])
def test_the_filter_is_the_textbook_one(jitter_sd):
    setup = Setup(runs=1, duration=2.0, jitter_sd=jitter_sd)
    problem = problem_of(setup)
    (result,) = problem.filtered(problem.start, setup.noise)
    white, total = plain_filter(problem, setup.noise)
    np.testing.assert_allclose(result.innovations, white, atol=2e-3)
    assert result.log_likelihood == pytest.approx(total, abs=0.05)


def test_prediction_errors_of_a_true_model_are_white():
    setup = Setup(runs=4)
    problem = problem_of(setup)
    errors = [r.innovations for r in problem.filtered(problem.start, setup.noise)]
    values = np.concatenate([e.ravel() for e in errors])
    assert abs(values.mean()) < 4.0 / np.sqrt(len(values))
    assert abs(values.var() - 1.0) < 4.0 * np.sqrt(2.0 / len(values))
    for lag in (1, 2, 5, 25):
        product = np.concatenate([(e[lag:] * e[:-lag]).ravel() for e in errors])
        assert abs(product.mean()) < 4.0 / np.sqrt(len(product))


def test_whiteness_notices_a_wrong_fish():
    setup = Setup(runs=4, changes={"tail.lift.c1": 3.4})
    problem = problem_of(setup)
    values = np.concatenate(
        [r.innovations.ravel() for r in problem.filtered(problem.start, setup.noise)]
    )
    assert values.var() > 1.0 + 8.0 * np.sqrt(2.0 / len(values))


def test_lanes_repeat_the_filter_and_slope_with_its_likelihood():
    setup = Setup(changes={"tail.lift.c1": 2.6})
    problem = problem_of(setup)
    filtered = problem.filtered(problem.start, setup.noise)
    free, zero = Free(problem, (), ()), np.zeros(len(PATHS))
    lin = linearise(problem, free, zero, setup.noise, filtered)
    own = np.concatenate([r.innovations.ravel() for r in filtered])
    np.testing.assert_allclose(lin.residuals, own, atol=1e-7)
    gradient = lin.slopes.T @ lin.residuals
    for i in range(len(PATHS)):
        values = []
        for step in (-0.05, 0.05):
            z = step * np.eye(len(PATHS))[i]
            values.append(
                sum(r.log_likelihood for r in problem.filtered(Point(z, {}), setup.noise))
            )
        assert gradient[i] == pytest.approx(
            -(values[1] - values[0]) / 0.1, rel=0.05, abs=0.05 * np.abs(gradient).max()
        )


def test_effects_that_are_off_change_no_bit():
    """Whichever kernel computes them, and whatever other lanes of a block have on."""
    setup = Setup()
    problem = problem_of(setup)
    names = ("servo_lag", "current", "added_mass", "tail_bias", "wake_memory")  # without corners
    off = problem.neutral(names)
    assert problem.batch_key(effects_of({})) < problem.batch_key(effects_of(off))
    alone, among = (
        problem.filtered(Point(problem.start.z, effects), setup.noise) for effects in ({}, off)
    )
    for a, b in zip(alone, among, strict=True):
        np.testing.assert_array_equal(a.innovations, b.innovations)
        np.testing.assert_array_equal(a.gains, b.gains)
    lanes = {id: np.full(3, value) for id, value in off.items()}
    lanes[EffectParameterId("servo_lag", "time_constant")][1] = 0.05
    lanes[EffectParameterId("current", "north")][2] = 0.1
    z = np.repeat(problem.start.z[:, None], 3, axis=1)
    plain = problem.innovations(z, {}, setup.noise, alone)
    beside = problem.innovations(z, lanes, setup.noise, alone)
    np.testing.assert_array_equal(beside[0], plain[0])
    assert np.all(np.any(beside[1:] != plain[1:], axis=1))


def test_a_replayed_noise_model_has_the_filters_likelihood():
    setup = Setup()
    problem = problem_of(setup)
    filtered = problem.filtered(problem.start, setup.noise, keep_slopes=True)
    same = problem.lean_filter.replay(filtered, setup.noise, setup.noise).log_likelihood
    assert same == pytest.approx(sum(r.log_likelihood for r in filtered), abs=1e-6)
    other = replace(setup.noise, force_sd=0.006, moment_sd=5e-5, correlation_s=0.5, phase_sd=0.02)
    other = replace(other, jitter_sd=0.003)
    full = sum(r.log_likelihood for r in problem.filtered(problem.start, other))
    replayed = problem.lean_filter.replay(filtered, setup.noise, other)
    assert replayed.log_likelihood == pytest.approx(full, abs=0.5)


def test_missing_samples_and_uneven_times_leave_the_errors_white():
    setup = Setup(runs=4, missing=0.3, uneven=True)
    problem = problem_of(setup)
    errors = np.concatenate(
        [
            r.innovations[np.isfinite(d.measured)]
            for r, d in zip(problem.filtered(problem.start, setup.noise), problem.runs, strict=True)
        ]
    )
    assert 0.6 < len(errors) / (4 * 201 * 9) < 0.8
    assert abs(errors.var() - 1.0) < 4.0 * np.sqrt(2.0 / len(errors))


@pytest.mark.parametrize("phase", [0.4, 2.0, 3.6, 5.5])
def test_an_unknown_phase_is_found_from_camera_channels(phase):
    channels = ("x", "y", "z", "yaw")
    setup = Setup(runs=2, rate=15.0, channels=channels, phase=phase, phase_known=False)
    problem = problem_of(setup)
    settled = settle_phases(problem, problem.start, setup.noise)
    for run in settled.runs:
        gap = (run.state0[13] - phase + np.pi) % (2 * np.pi) - np.pi
        assert abs(gap) < 0.6
    last = settled.filtered(settled.start, setup.noise)[0].states[-1, 13]
    assert np.isfinite(last)


def test_known_phases_are_left_alone():
    problem = problem_of(Setup(runs=1, duration=1.0))
    assert settle_phases(problem, problem.start, Setup().noise) is problem


def test_one_thread_or_two_give_the_same_bits(monkeypatch):
    from fish_env.identification import filtering

    setup = Setup(duration=2.0)
    results = []
    for threads in ("1", "2"):
        monkeypatch.setenv("ROBOFISH_THREADS", threads)
        filtering._threads.cache_clear()
        problem = problem_of(setup)
        filtered = problem.filtered(problem.start, setup.noise)
        lanes = problem.innovations(
            np.random.default_rng(0).normal(size=(len(PATHS), 40)), {}, setup.noise, filtered
        )
        results.append((filtered[1].innovations, lanes))
    filtering._threads.cache_clear()
    np.testing.assert_array_equal(results[0][0], results[1][0])
    np.testing.assert_array_equal(results[0][1], results[1][1])


@pytest.mark.parametrize(
    ("parameter", "value"),
    [
        (EffectParameterId("gyro_bias", "r"), 0.03),
        (EffectParameterId("position_scale", "scale"), 1.4),
        (EffectParameterId("sensor_delay", "delay"), 0.06),
        (EffectParameterId("clock_scale", "scale"), 1.01),
        (EffectParameterId("clock_skew", "scale"), 1.01),
        (EffectParameterId("attitude_misalignment", "pitch"), 0.08),
        (EffectParameterId("marker_offset", "x"), 0.06),
        (EffectParameterId("camera_tilt", "roll"), 0.4),
        (EffectParameterId("soft_iron", "amplitude"), 0.1),
        (EffectParameterId("gyro_scale", "r"), 0.8),
    ],
)
def test_measurement_effects_reach_the_lanes(parameter, value):
    """A lane with the effect says the same as the filter with it, so their difference is real."""
    setup = Setup(runs=1, duration=4.0)
    problem = problem_of(setup)
    filtered = problem.filtered(problem.start, setup.noise)
    zero = np.zeros((len(PATHS), 1))
    (lane,) = problem.innovations(zero, {parameter: np.array([value])}, setup.noise, filtered)
    own = filtered[0].innovations.ravel()
    assert lane @ lane > own @ own + 20.0
    (distorted,) = problem.filtered(Point(zero[:, 0], {parameter: value}), setup.noise)
    assert distorted.log_likelihood < filtered[0].log_likelihood - 10.0


ASKEW = {
    "attitude_misalignment": {"roll": 0.08, "pitch": -0.06, "yaw": 0.1},
    "marker_offset": {"x": 0.06, "y": 0.03, "z": -0.08},
    "camera_tilt": {"roll": 0.4, "pitch": 0.3},
    "refraction": {"height": 1.0},
    "soft_iron": {"amplitude": 0.1, "angle": 0.3},
    "gyro_scale": {"p": 0.9, "q": 1.1, "r": 0.8},
}


def seen_by(data, effects):
    """The data as sensors with these effects would have shown them."""
    model = build_model(load_fish("zheng-2021-a"), effects)
    runs = [replace(r, channels=measured_channels(model, r.channels)) for r in data.runs]
    return replace(data, runs=tuple(runs))


@pytest.mark.parametrize("name", ASKEW)
def test_the_filter_sees_through_the_sensors_geometry(name):
    """With the effect, distorted data are as likely as the true ones; without it, hardly."""
    setup = Setup(runs=1, duration=4.0)
    data = simulate(setup)
    zero = np.zeros(len(PATHS))
    values = {EffectParameterId(name, key): value for key, value in ASKEW[name].items()}
    plain, distorted = (
        SeriesProblem(d, paths=PATHS) for d in (data, seen_by(data, {name: ASKEW[name]}))
    )
    (true,) = plain.filtered(Point(zero, {}), setup.noise)
    (undone,) = distorted.filtered(Point(zero, values), setup.noise)
    (blind,) = distorted.filtered(Point(zero, {}), setup.noise)
    assert undone.log_likelihood > true.log_likelihood - 25.0
    if name not in ("refraction", "camera_tilt"):  # at one depth a scale, hardly seen so soon
        assert blind.log_likelihood < true.log_likelihood - 60.0


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("marker_offset", ASKEW["marker_offset"]),
        ("camera_tilt", ASKEW["camera_tilt"]),
        ("refraction", ASKEW["refraction"]),
        ("attitude_misalignment", {"roll": 0.08, "pitch": -0.06}),
    ],
)
def test_lanes_show_what_the_sensors_geometry_says(name, values):
    """Place, angles and rates as :func:`through_geometry` has them, but for the start's place."""
    setup = Setup(runs=1, duration=2.0)
    problem = SeriesProblem(simulate(setup), paths=PATHS)

    def shown(effects):
        point = Point(np.zeros(len(PATHS)), effects)
        (run,) = problem.runs
        seen = run.measured - errors(problem, point, setup.noise)[0]
        return dict(zip(problem.channels, seen.T, strict=True))

    geometry = catalogue()[name].geometry({**catalogue()[name].neutral, **values})
    expected = through_geometry(shown({}), geometry)
    found = shown({EffectParameterId(name, key): value for key, value in values.items()})
    scale = {"x": 1.0, "y": 1.0}
    for channel in problem.channels:
        offset = (found[channel] - expected[channel])[np.isfinite(found[channel])]
        offset = offset - offset[0] * scale.get(channel, 0.0)
        np.testing.assert_allclose(offset, 0.0, atol=2e-6, err_msg=channel)


@pytest.mark.parametrize(
    ("name", "moves_commands", "scale"),
    [
        ("clock_scale", 1, 0.5),
        ("clock_scale", 1, 1.02),
        ("clock_scale", 1, 2.0),
        ("clock_skew", 0, 0.5),
        ("clock_skew", 0, 1.02),
    ],
)
def test_the_filter_sees_through_a_clock(name, moves_commands, scale):
    """One clock stamps commands and samples alike; the skew of two leaves the commands."""
    # As many samples, no more than a fit uses of a second by the clock of the record.
    slow = max(1.0, round(scale))
    setup = Setup(runs=1, duration=4.0 * slow, rate=25.0 / slow)
    data = simulate(setup)
    (run,) = data.runs
    told = run.commands.times_s / (scale if moves_commands else 1.0)
    commands = CommandSteps(told, run.commands.values)
    stamped = Run.from_steps(
        run.id,
        run.time_s / scale,
        run.channels,
        commands,
        start=run.start,
        tail_phase=run.tail_phase,
    )
    zero = np.zeros(len(PATHS))
    true_problem = SeriesProblem(data, paths=PATHS)
    other = SeriesProblem(replace(data, runs=(stamped,)), paths=PATHS)
    (true,) = true_problem.filtered(Point(zero, {}), setup.noise)
    point = Point(zero, {EffectParameterId(name, "scale"): scale})
    noise = replace(setup.noise, correlation_s=setup.noise.correlation_s / scale)
    (undone,) = other.filtered(point, noise)
    (blind,) = other.filtered(Point(zero, {}), noise)
    # Steps of the recorded time are longer or shorter than those of the true one.
    assert undone.log_likelihood > true.log_likelihood - (25.0 if scale < 2.0 else 250.0)
    assert blind.log_likelihood < true.log_likelihood - (60.0 if scale == 1.02 else 1000.0)
