"""Fits to whole runs, and the fish that was identified from the measured ones."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import Run, load_dataset
from fish_env.data.schema import CommandSteps
from fish_env.errors import DatasetError
from fish_env.params import load_fish
from fish_env.studies.real_fish import (
    EFFECTS,
    PATHS,
    covariance,
    errors_of,
    groups_of,
    identified,
    repeat_scatter,
    second_half,
    summary,
)
from fish_env.studies.rollouts import PACE, WholeRuns
from fish_env.studies.tracks import Track, Weights, integrated_ou, track_of, tracks_of
from fish_env.studies.whole_runs import fit_runs, predict
from tests.fixtures.measured_data import measured_runs

IDENTIFIED = "msu-tail-fish-identified"
EXACT = Weights(1e-3, 1e-2, 1e-3, 5e-3, 3.0)
FREE = ("tail.lift.c1", "body.plane_xy.drag.c0")


def swum(x, conditions=((0.35, 0.3), (-0.35, 0.45)), noise=0.0, seed=0):
    """Runs of the starting fish with other coefficients."""
    rng = np.random.default_rng(seed)
    model = WholeRuns(load_fish("msu-tail-fish"), FREE)
    tracks = []
    for i, (offset, amplitude) in enumerate(conditions):
        time = np.arange(0.0, 8.0, 0.1)
        command = np.array([offset, amplitude, 1.0, 0.0, 0.0])
        blank = Track(f"r{i}", f"c{i}", time, np.zeros((len(time), 3)), command)
        start = np.array([0.0, 0.0, 0.2, 0.02, 0.0, 0.0, 1.0, 0.97])
        pose = model.roll(blank, np.array(x)[:, None], start[:, None])[0]
        pose += noise * rng.standard_normal(pose.shape) * [1.0, 1.0, 10.0]
        tracks.append(replace(blank, measured=pose))
    return tracks


@pytest.fixture(scope="module")
def found():
    tracks = swum([0.4, -0.5], noise=5e-4)
    model = WholeRuns(load_fish("msu-tail-fish"), FREE)
    return tracks, fit_runs(model, tracks, EXACT)


def test_coefficients_starts_and_pace_are_found(found):
    _, fit = found
    sd = np.sqrt(np.diag(np.linalg.inv(fit.information)))
    assert fit.x[0] == pytest.approx(0.4, abs=0.1)
    assert np.all(np.abs(fit.x - [0.4, -0.5]) < 3 * sd)
    assert fit.starts[:, PACE] == pytest.approx(0.97, abs=0.003)
    assert fit.starts[:, 3] == pytest.approx(0.02, abs=0.004)


def test_intervals_are_of_the_size_of_the_errors(found):
    tracks, fit = found
    sd = np.sqrt(np.diag(covariance(fit, tracks)))
    truth = fit.model.values(np.array([[0.4], [-0.5]]))[:, 0]
    assert np.all(np.abs(fit.model.values(fit.x[:, None])[:, 0] - truth) < 4 * sd)
    assert np.all(sd < fit.model.baseline.sd)


def test_a_run_is_predicted_from_its_beginning(found):
    tracks, fit = found
    predicted = predict(fit.model, fit.x, tracks[0], EXACT, 0.97, 3.0)
    assert np.abs(predicted - tracks[0].measured)[:, :2].max() < 0.01
    wrong = predict(fit.model, fit.x + 2.0, tracks[0], EXACT, 0.97, 3.0)
    assert np.abs(wrong - tracks[0].measured)[:, :2].max() > 0.02


def test_the_fish_carries_what_was_found(found):
    tracks, fit = found
    fish = identified(fit, tracks, "pool", "test")
    assert fish.info("tail.lift.c1").status == "identified"
    assert fish.posterior.names == (*FREE, "effects.frequency_scale.scale")
    assert fish.effects["frequency_scale"]["scale"] == pytest.approx(0.97, abs=0.003)


def test_errors_of_speed_and_position_have_the_covariance_assumed():
    rng = np.random.default_rng(0)
    dt, memory, count = 0.02, 0.5, 4000
    keep = np.exp(-dt / memory)
    speed = rng.standard_normal(count)
    total, values = np.zeros(count), []
    for _ in range(100):
        total += speed * dt
        values.append(total.copy())
        speed = keep * speed + np.sqrt(1 - keep**2) * rng.standard_normal(count)
    time = dt * np.arange(1, 101)
    drawn = np.cov(np.array(values)[[24, 99]])
    np.testing.assert_allclose(integrated_ou(time, memory)[[24, 99]][:, [24, 99]], drawn, rtol=0.1)


def test_whitening_makes_such_errors_white():
    time, weights = np.linspace(0.0, 5.0, 40), Weights()
    covariance_ = weights.speed_sd**2 * integrated_ou(time, weights.memory_s)
    covariance_ += weights.position_sd**2 * np.eye(40)
    white = weights.whitening(time, False)
    np.testing.assert_allclose(white @ covariance_ @ white.T, np.eye(40), atol=1e-8)


def test_second_halves_are_those_of_a_circle():
    time = np.linspace(0.0, 10.0, 200)
    yaw = 0.1 * time
    pose = np.column_stack([0.5 * np.sin(yaw), 0.5 * (1 - np.cos(yaw)), yaw])
    track = Track("r", "c", time, pose, np.zeros(5))
    assert second_half(track, pose) == pytest.approx([0.05, 0.0, 0.1], abs=1e-4)


def test_conditions_are_left_out_whole():
    tracks = swum([0.0, 0.0], [(0.1 * i, 0.3) for i in range(10)])
    groups = groups_of(tracks)
    assert sorted(name for group in groups for name in group) == sorted(t.condition for t in tracks)


def test_changing_commands_and_missing_channels_are_refused():
    time = np.linspace(0.0, 5.0, 20)
    steps = CommandSteps(time[[0, 10]], np.array([[0.1, 0.3, 1.0, 0, 0], [0.2, 0.3, 1.0, 0, 0]]))
    pose = {name: np.zeros(20) for name in ("x", "y", "yaw")}
    with pytest.raises(DatasetError, match="commands change"):
        track_of(Run("r", time, pose, steps, "unknown"))
    held = CommandSteps(steps.times_s[:1], steps.values[:1])
    with pytest.raises(DatasetError, match="measure all three"):
        track_of(Run("r", time, {"x": time}, held, "unknown"))


def test_the_identified_fish_is_shipped_with_its_intervals():
    fish = load_fish(IDENTIFIED)
    assert fish.posterior is not None
    assert set(fish.posterior.names) >= {*PATHS, *(f"effects.{name}" for name in EFFECTS)}
    assert fish.info("tail.lift.c1").status == "identified"
    assert np.linalg.eigvalsh(np.array(fish.posterior.covariance)).min() > -1e-9
    assert 0.0 < fish.effects["wake_fraction"]["fraction"] < 1.0


@pytest.mark.measured
@pytest.mark.slow
def test_the_identified_fish_predicts_the_measured_runs():
    tracks = tracks_of(load_dataset(measured_runs()))
    fish = load_fish(IDENTIFIED)
    pace = fish.effects["frequency_scale"]["scale"]
    kept = {name: values for name, values in fish.effects.items() if name != "frequency_scale"}
    shipped = WholeRuns(replace(fish, effects=kept, posterior=None), PATHS)
    start = WholeRuns(load_fish("msu-tail-fish"), PATHS)
    nothing = np.zeros(len(PATHS))
    good = summary(errors_of(shipped, nothing, tracks, pace))
    before = summary(errors_of(start, nothing, tracks, 1.0))
    surge, _, yaw_rate = repeat_scatter(tracks)
    assert good["surge"] < 2.0 * surge
    assert good["yaw_rate"] < 2.0 * yaw_rate
    assert good["path"] < 0.6 * before["path"]
    assert good["yaw"] < 0.6 * before["yaw"]
