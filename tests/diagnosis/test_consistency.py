"""Channels that belong together agree; a sensor that is off is found, with its size and error."""

import json

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.identification.recorded import recorded
from fish_env.rigidbody import kinematic_fit
from fish_env.rigidbody.consistency import (
    NEEDS,
    as_dict,
    check_consistency,
    sentences,
)
from fish_env.rigidbody.kinematics import integrator, relations_of
from tests.diagnosis.kinematic_data import NOISE, measured

EVERY = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")
GYRO, ANGLES = ("p", "q", "r"), ("roll", "pitch", "yaw")


DRAWS = 599


def checked(seed=0, **wrong):
    rng = np.random.default_rng(seed)
    return check_consistency(recorded(measured(seed, **wrong)), rng, draws=DRAWS)


def estimates(consistency):
    return {e.name: e for relation in consistency.tested for e in relation.estimates}


PATHS = {"channels": EVERY, "runs": 6}
WRONG = {
    "gyro_bias": ({"bias": {"q": 0.02}}, "gyro_bias", "attitude.bias_q", 0.02),
    "pitch": ({"bias": {"pitch": 0.05}}, "attitude_misalignment", "attitude.pitch_offset", 0.05),
    "roll": ({"bias": {"roll": -0.05}}, "attitude_misalignment", "attitude.roll_offset", -0.05),
    "clock": ({"clock": 1.02}, "clock_scale", "attitude.scale", 0.02),
    "late gyro": ({"late": dict.fromkeys(GYRO, 0.03)}, None, "attitude.delay", 0.03),
    "yaw": (
        {**PATHS, "bias": {"yaw": 0.05}}, "attitude_misalignment",
        "position.yaw_offset", 0.05,
    ),
    "metre": (
        {**PATHS, "gain": dict.fromkeys("xyz", 1.05)}, "position_scale",
        "position.scale", 0.05,
    ),
    "log": ({**PATHS, "bias": {"v": 0.03}}, None, "position.bias_v", 0.03),
    "camera": (
        {**PATHS, "late": dict.fromkeys("xyz", 0.1)}, None, "position.delay", -0.1
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(WRONG))
def test_what_is_off_is_found_with_its_size(name):
    wrong, effect, setting, size = WRONG[name]
    found = checked(**wrong)
    e = estimates(found)[setting]
    assert e.found
    assert abs(e.value - size) < 4.0 * e.error
    assert abs(size) > 3.0 * e.error
    if effect is None:
        assert setting in {u.name for u in found.unnamed}
        assert found.found == ()
    else:
        assert found.found == (effect,)
    assert any(f"{100 * size:+.3g}"[:2] in s or setting in s or str(effect) in s
               for s in sentences(found)[:1])  # fmt: skip


def test_a_wrong_clock_is_not_a_wrong_metre():
    found = checked(**PATHS, clock=1.03)
    assert found.found == ("clock_scale",)
    e = estimates(found)["position.scale"]
    assert abs(e.value - 0.03) < 4.0 * e.error


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, pytest.param(1.0, marks=pytest.mark.long)])
def test_consistent_channels_agree_whatever_the_colour_of_the_noise(colour):
    """Of 40 sets some 8 may stand out at 20 %, hardly one at 1 %."""
    smallest = []
    for seed in range(40):
        found = checked(100 + seed, colour=colour)
        smallest.append(min(e.p for e in estimates(found).values()))
    smallest = np.array(smallest)
    assert (smallest < 0.01).sum() <= 2
    assert (smallest < 0.2).sum() <= 16


def test_errors_that_trust_white_noise_would_raise_false_alarms():
    """The same fits, judged by the curvature alone: coloured noise makes far too many stand out."""
    alarms = 0
    for seed in range(12):
        dataset = measured(100 + seed, colour=1.0)
        relation = relations_of(dataset.channels)[0]
        values, scores, _ = kinematic_fit._fit(recorded(dataset), relation, NOISE)
        naive = np.sqrt(np.diag(np.linalg.inv(scores.curvature.sum(0))))
        alarms += np.abs(values / naive).max() > 3.3
    assert alarms >= 3


@pytest.mark.slow
def test_the_smallest_detectable_size_is_found_about_four_times_in_five():
    size = estimates(checked(1, runs=4))["attitude.bias_r"].detectable
    found = [
        estimates(checked(200 + s, runs=4, bias={"r": size}))["attitude.bias_r"].found
        for s in range(30)
    ]
    assert 0.5 < np.mean(found) < 0.99


def test_motion_that_is_too_quick_for_the_samples_contradicts_nothing():
    """A spline through samples at 25 Hz misses part of a shaking at 11 Hz, at 100 Hz hardly any."""
    found = estimates(checked(rate=25.0, shake=0.5))["attitude.scale"]
    assert abs(found.value) > 0.01
    assert not found.found
    often = estimates(checked(rate=100.0, shake=0.5))["attitude.scale"]
    assert abs(often.value) < 3.0 * often.error < 0.01


def test_a_camera_alone_says_little_and_says_so():
    found = checked(channels=("x", "y", "z", "yaw"), rate=15.0)
    assert found.tested == ()
    assert found.found == ()
    said = " ".join(sentences(found))
    assert "No kinematic relation connects x, y, z, yaw" in said
    assert "gyro_bias: not detectable without roll, pitch, p, q, r." in said


def test_short_runs_are_not_tested():
    found = checked(seconds=2.0)
    assert found.found == ()
    assert "too short" in " ".join(sentences(found))


def test_a_film_from_above_is_taken_to_be_level_and_says_so():
    found = checked(channels=("x", "y", "yaw", "r"), runs=2)
    assert set(estimates(found)) == {"attitude.bias_r", "attitude.scale"}
    assert any("assumed to be level" in s for s in sentences(found))


def test_runs_that_do_not_begin_at_rest_though_declared_so():
    dataset = measured(0, start="rest")
    found = check_consistency(recorded(dataset), np.random.default_rng(0), draws=DRAWS)
    assert any(e.name.startswith("start.") for e in found.unnamed)
    assert any("start: unknown" in s for s in sentences(found))


def test_every_effect_of_measurement_has_its_needs():
    searched = [effect for effect in catalogue().values() if effect.diagnosed]
    assert {e.name for e in searched if e.section == "measurement"} == set(NEEDS)


def test_the_answer_is_plain_json():
    content = json.loads(json.dumps(as_dict(checked(bias={"p": 0.05})), allow_nan=False))
    shown = {e["name"]: e for e in content["effects"]}
    assert shown["gyro_bias"]["found"]
    assert shown["gyro_bias"]["parameters"]["p"]["standard_error"] > 0.0
    assert not shown["sensor_delay"]["testable"]


def test_gaps_and_patchy_samples_do_not_bias():
    dataset = measured(3, runs=6)
    rng = np.random.default_rng(0)
    for run in dataset.runs:
        for values in run.channels.values():
            values[rng.random(len(values)) < 0.05] = np.nan
            values[100:140] = np.nan
    found = check_consistency(recorded(dataset), rng, draws=DRAWS)
    assert found.found == ()
    assert found.tested[0].windows >= 8


def test_integration_is_exact_for_cubics_and_bends_at_breaks():
    t = np.linspace(0.0, 4.0, 41)
    whole = integrator(t, t[::2], np.zeros(1))
    assert np.allclose(np.cumsum(whole @ t**3), t[2::2] ** 4 / 4, atol=1e-9)
    kinked = integrator(t, t, np.array([0.0, 2.0]))
    assert np.isclose((kinked @ np.abs(t - 2.0)).sum(), 4.0, atol=1e-9)
    assert abs((integrator(t, t, np.zeros(1)) @ np.abs(t - 2.0)).sum() - 4.0) > 1e-4
