"""Misfit is placed where it is, and nowhere when residuals are only noise."""

import json

import numpy as np
import pytest

from fish_env.diagnosis.regimes import RunResiduals, as_plain, localise

CHANNELS = ("yaw", "p", "r")


def runs_of(rng, count=6, samples=400, coloured=0.0):
    """Residuals of sd 1, correlated in time if wanted, beside a swim with two frequencies."""
    result = []
    for i in range(count):
        noise = rng.normal(size=(samples, len(CHANNELS)))
        for k in range(1, samples):
            noise[k] = coloured * noise[k - 1] + np.sqrt(1 - coloured**2) * noise[k]
        time = 0.04 * np.arange(samples)
        frequency = np.full(samples, (0.8, 1.7)[i % 2])
        regimes = {
            "speed": 0.1 + 0.08 * np.sin(0.5 * time + i),
            "pitch": 0.2 * np.sin(0.3 * time + 2 * i),
            "depth": 1.0 + 0.1 * np.cos(0.2 * time + i),
            "tail_phase": (2 * np.pi * frequency * time + i) % (2 * np.pi),
            "tail_amplitude": np.full(samples, 0.4),
            "tail_frequency": frequency,
            "time": time,
        }
        result.append(RunResiduals(noise, regimes))
    return result


def test_misfit_at_speed_is_found_in_its_channel_and_bin():
    rng = np.random.default_rng(0)
    runs = runs_of(rng)
    for run in runs:
        run.residuals[run.regimes["speed"] > 0.15, 2] *= 2.0
    found = localise(CHANNELS, runs, rng, 199)
    assert found.sits_in.channel == "r"
    assert found.sits_in.regime == "speed"
    assert found.sits_in.bin == "0.15 to 0.2 m/s"
    assert found.sits_in.energy == pytest.approx(4.0, rel=0.3)
    assert found.sits_in.p == pytest.approx(1 / 200)
    assert "largest excess is speed 0.15 to 0.2 m/s. There the misfit in r is" in found.words()


def test_false_alarms_stay_within_the_level_even_when_residuals_are_coloured():
    alarms = 0
    for seed in range(40):
        rng = np.random.default_rng([1, seed])
        runs = runs_of(rng, count=4, samples=200, coloured=0.9)
        alarms += localise(CHANNELS, runs, rng, 99).sits_in is not None
    assert alarms <= 6  # 2 expected; 7 or more has probability 0.003 at a rate of 0.05


def test_a_regime_that_never_changes_within_a_run_is_judged_over_runs():
    rng = np.random.default_rng(2)
    runs = runs_of(rng, count=2)
    runs[1].residuals[:, 0] *= 3.0
    found = localise(CHANNELS, runs, rng, 199)
    frequencies = found.p_values["tail_frequency"]
    assert np.nanmin(frequencies) > 0.05  # two runs cannot tell frequency from chance


def test_what_was_never_visited_is_named():
    found = localise(CHANNELS, runs_of(np.random.default_rng(3)), np.random.default_rng(3), 19)
    visited = set(found.never_visited)
    assert ("speed", "0.2 to 0.3 m/s") in visited
    assert ("tail_frequency", "2 to 2.5 Hz") in visited
    assert ("tail_frequency", "0.5 to 1 Hz") not in visited
    assert not any(regime in ("depth", "time") for regime, _ in visited)


def test_data_beyond_the_bins_get_a_bin_of_their_own():
    runs = runs_of(np.random.default_rng(4))
    runs[0].regimes["speed"][:50] = 0.5
    found = localise(CHANNELS, runs, np.random.default_rng(4), 19)
    speed = next(regime for regime in found.regimes if regime.name == "speed")
    assert speed.labels[-1] == "0.3 to 0.5"
    assert found.counts["speed"][0, -1] == 50


def test_missing_samples_are_not_counted():
    runs = runs_of(np.random.default_rng(5))
    runs[0].residuals[:, 1] = np.nan
    found = localise(CHANNELS, runs, np.random.default_rng(5), 19)
    assert found.counts["time"][1].sum() == 5 * 400
    assert found.counts["time"][0].sum() == 6 * 400
    assert found.overall["p"] == pytest.approx(1.0, abs=0.1)


def test_the_table_is_plain_json():
    found = localise(CHANNELS, runs_of(np.random.default_rng(6)), np.random.default_rng(6), 19)
    plain = json.loads(json.dumps(as_plain(found), allow_nan=False))
    assert {"sits_in", "words", "never_visited", "channels", "regimes"} == set(plain)
    for regime in plain["regimes"]:
        assert len(regime["energy"]) == len(CHANNELS)
        assert len(regime["energy"][0]) == len(regime["edges"]) - 1
