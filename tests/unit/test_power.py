"""The statistics of the power benchmark: curves recover what made the counts, intervals cover."""

import json

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from fish_env.data import load_dataset
from fish_env.identification import SeriesProblem
from scripts.benchmark_power import AGAIN, SIZES, TARGETS, looks
from scripts.power.curves import Curve, fit_curve, strength
from scripts.power.limits import limits, noncentrality
from scripts.power.looks import NOTHING, Target
from scripts.power.report import draw, summarise, write
from scripts.results import today
from tests.hidden.designs import Noise, swim_design
from tests.hidden.plans import Plan

TRUE = Curve(1.15, 0.0, 0.0, 7.0, 0)
AT = np.repeat(SIZES, 8)
SHORT = Plan(runs=1, duration=3.0)


def counted(rng: np.random.Generator, sizes: np.ndarray = AT) -> Curve:
    return fit_curve(sizes, rng.random(len(sizes)) < TRUE.share(sizes))


def test_a_curve_has_power_where_it_says():
    assert TRUE.share(np.array([1.15, 1e-3, 1e3])) == pytest.approx([0.8, 0.0, 1.0], abs=1e-6)


def test_many_counts_recover_the_curve():
    curve = counted(np.random.default_rng(0), np.repeat(AT, 100))
    assert curve.at == pytest.approx(TRUE.at, rel=0.04)
    assert curve.steepness == pytest.approx(TRUE.steepness, rel=0.1)
    assert curve.high < 1.05 * curve.low


def test_intervals_of_few_counts_cover_the_truth():
    rng = np.random.default_rng(1)
    found = [counted(rng) for _ in range(150)]
    assert 0.91 < np.mean([c.low <= TRUE.at <= c.high for c in found]) < 0.99
    assert np.median([c.at for c in found]) == pytest.approx(TRUE.at, rel=0.03)
    wrong = np.mean([c.low <= 2.0 * TRUE.at <= c.high for c in found])
    assert wrong < 0.2  # an interval that held everything would cover, too


def test_counts_that_bound_nothing_say_so():
    none = fit_curve(SIZES, [False] * len(SIZES))
    every = fit_curve(SIZES, [True] * len(SIZES))
    assert none.high == pytest.approx(5.0)
    assert none.low > 1.0
    assert every.low == pytest.approx(0.2)


@pytest.mark.parametrize("freedom", [1, 3])
def test_what_a_test_needs_gives_it_its_power(freedom):
    needed = noncentrality(1e-3, freedom)
    assert ncx2.sf(chi2.isf(1e-3, freedom), freedom, needed) == pytest.approx(0.8)
    assert needed < noncentrality(1e-4, freedom)


def test_statistics_tell_how_strong_the_signals_were():
    rng = np.random.default_rng(2)
    promised = 18.0 * AT**2
    held = 0
    for _ in range(200):
        over = rng.noncentral_chisquare(3, 0.7**2 * promised) - 3
        of = strength(over, promised, [3] * len(AT))
        held += of["low"] <= 0.7 <= of["high"]
    assert 0.91 < held / 200 < 0.99
    assert of["ratio"] == pytest.approx(0.7, abs=0.1)


def test_every_data_set_has_noise_and_a_file_of_its_own():
    todo = list(looks(3, 2))
    assert len({look.file for look in todo}) == len(todo)
    seeds = [(look.design, look.repeat) for look in todo]
    assert len(set(seeds)) == len(seeds)
    assert not {look.repeat for look in todo} & set(NOTHING.values())
    assert sum(look.noise == "double" for look in todo) == 2 * len(AGAIN) * len(SIZES)
    assert sum(look.whole for look in todo) == len(TARGETS)


def test_a_target_moves_one_parameter_from_where_it_does_nothing():
    assert Target("frequency_scale", "scale", -1.0).values(0.1) == {
        "frequency_scale": {"scale": pytest.approx(0.9)}
    }
    moved = Target("current", "north").values(0.02)["current"]
    assert moved == {"north": 0.02, "east": 0.0, "down": 0.0}


def test_repeats_of_a_design_share_all_but_noise_and_effect(tmp_path):
    gyro = {"gyro_bias": {"p": 0.5, "q": 0.0, "r": 0.0}}
    cases = {"a": (0, {}), "again": (0, {}), "other": (1, {}), "biased": (0, gyro)}
    runs, truths = {}, {}
    for name, (repeat, effects) in cases.items():
        folder = tmp_path / name
        truths[name] = swim_design(3, repeat, folder, effects, Noise(sensors=2.0), SHORT)
        (runs[name],) = load_dataset(folder).runs
    first = runs["a"]
    for run in runs.values():
        np.testing.assert_array_equal(run.commands.values, first.commands.values)
    np.testing.assert_array_equal(runs["again"].channels["p"], first.channels["p"])
    assert np.all(runs["other"].channels["p"] != first.channels["p"])
    np.testing.assert_allclose(runs["biased"].channels["p"] - 0.5, first.channels["p"])
    assert truths["a"].coefficients == truths["biased"].coefficients
    assert truths["a"].noise["x"] == 0.004
    assert truths["biased"].effects == gyro


def test_information_of_runs_bounds_what_can_be_found(tmp_path):
    """Less than at the screen's level would do at 5 %, and less still with coefficients known."""
    truth = swim_design(3, 0, tmp_path / "runs", {}, Noise(), SHORT)
    problem = SeriesProblem(load_dataset(tmp_path / "runs"))
    found = limits(problem, truth, {"linear_drag.surge": 0.1, "servo_lag.time_constant": 0.02}, -7)
    (sizes,) = found.values()  # a lag's size is bounded by the step of the simulation
    assert 0.0 < sizes["known"] < sizes["same"]
    assert sizes["alone"] < sizes["same"]


def row(target: str, multiple: float, found: bool, noise: str = "nominal") -> dict:
    return {
        "target": target, "multiple": multiple, "design": 0, "repeat": 1, "noise": noise,
        "found": found, "misfit": True, "first": target, "statistic": 20.0 * multiple**2,
        "freedom": 1, "bound": 12.0, "cpu_s": 60.0,
    }  # fmt: skip


def test_a_summary_is_written_with_its_picture(tmp_path):
    rows = [row("current.north", k, k > 0.9, n) for k in SIZES for n in ("nominal", "double")]
    rows += [row("gyro_bias.r", 1.0, False)]
    whole = {key: rows[0][key] for key in ("target", "multiple", "design", "noise", "cpu_s")}
    rows += [{**whole, "verdict": "cause", "named": ["current"]}]
    limit = {"same": 0.9, "alone": 0.5, "known": 0.3}
    nothing = {
        "design": 0, "noise": "nominal", "alarm": False, "cpu_s": 60.0,
        "published": {"current.north": 1.0, "servo_lag.time_constant": 0.01},
        "in_proportion": {"current.north": 2.0, "servo_lag.time_constant": 0.01},
        "limits": {"current.north": limit},
    }  # fmt: skip
    signals = {"sensor_delay.delay": {"cosine": 0.4, "share": 0.5}}
    summary = summarise(rows, [nothing], signals)
    north = summary["noises"]["nominal"]["current.north"]
    assert north["counts"]["1"]["count"] == 1
    assert 0.8 < north["found"]["at"] < 1.2
    assert summary["noises"]["nominal"]["all"]["found"]["looks"] == len(SIZES) + 1
    assert summary["catalogue"]["current.north"]["same"] == pytest.approx(1 / 0.9)
    write(summary, tmp_path)
    draw(summary, tmp_path / "images" / "power.png")
    page = (tmp_path / f"power-{today()}.md").read_text()
    assert "| current.north | 0/1 | 0/1 | 1/1 | 1/1 |" in page
    assert "| gyro_bias.r | - | - | 0/1 | - |" in page
    assert "| sensor_delay.delay | 0.40 | 0.50 |" in page
    written = json.loads((tmp_path / f"power-{today()}.json").read_text())
    assert written["data_sets"] == len(rows) + 1
    assert (tmp_path / "images" / "power.png").stat().st_size > 10_000
