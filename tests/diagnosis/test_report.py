"""The report holds what the answer says, for every verdict, with series or without."""

import re

import numpy as np
import pandas as pd
import pytest

from fish_env.diagnosis.headline import headline
from fish_env.diagnosis.regimes import localise_fits
from fish_env.diagnosis.report import series_from, write_report
from fish_env.diagnosis.report.html import inline, text
from fish_env.identification.series import SeriesProblem
from fish_env.inference.effort import QUICK
from fish_env.inference.estimate.fit import fit
from fish_env.inference.gain import ClosedGap
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.problem import Point
from fish_env.inference.verdict import VERDICTS
from fish_env.simulator import schedule
from tests.diagnosis.report_cases import answer, run_series, steady_series

NETWORK = re.compile(r"""(src|href)=["'](?!data:|#)|@import|url\((?!['"]?(#|data:))""")


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return write_report(answer(), run_series(), folder).read_text(), folder


def test_the_page_has_every_part(full):
    page, _ = full
    for part in (
        "The simulation lacks servo_lag", "0.05 to 0.058", "rf-replay", "r01 (held out)",
        "Location of the misfit", "tail phase 0 to 45 deg", "never visited", "Ranking",
        "could not have shown: surface_drag", "tether (0.61)", "0.004 m/s", "Next experiment",
        "mass.total", "closes 96 %", "Error budget", "cm off", "Next:",
        "a note about this run", "one note",
        "roll, p agree with each other", "0.109 to 0.12",
    ):  # fmt: skip
        assert part in page, part


def test_what_is_beyond_the_usual_is_told(tmp_path):
    varied = [
        {"name": "trim_y", "unit": "m", "sd": 4e-4, "usual_sd": 1e-4, "shared": False,
         "beyond_usual": True, "values": [-3e-4, 5e-4]},
        {"name": "camera_roll", "unit": "rad", "sd": 0.06, "usual_sd": 0.017, "shared": True,
         "beyond_usual": True, "values": [0.05, 0.05]},
        {"name": "buoyancy", "unit": "kg", "sd": 3e-4, "usual_sd": 4e-4, "shared": False,
         "beyond_usual": False, "values": [-1e-4, 2e-4]},
    ]  # fmt: skip
    noise = {"disturbance": {"jitter_sd": 0.0034}}
    told = answer(run_variation=varied, noise=noise)
    page = write_report(told, None, tmp_path).read_text()
    for part in (
        "Trim y differs between runs by 0.0004 m (one standard deviation), 4 times the usual",
        "Camera roll is off by about 0.06 rad",
        "Samples are 3.4 ms early or late",
        "0.0005",
    ):
        assert part in page, part
    assert "Buoyancy differs" not in page


@pytest.mark.parametrize("count", [1, 2, 3])
def test_intervals_over_runs_need_three_of_them(count, tmp_path):
    told = answer(fitted_runs=count)
    told["gain"]["final_runs"] = [f"r{i}" for i in range(count)]
    page = write_report(told, None, tmp_path).read_text()
    shown = count >= 3
    assert ("(95 %: 90 to 100 %)" in page) == shown
    assert ("(95 % interval: 90 to 100 %)" in page) == shown
    assert ("Lines: 95 % intervals over runs" in page) == shown
    assert ("no interval over runs" in page) == (not shown)
    ranking = (tmp_path / "figures" / "ranking.svg").read_text()
    assert ("stroke-width: 1.4" in ranking) == shown


def test_the_next_experiment_is_a_table_to_fly(full):
    page, folder = full
    flown = schedule(pd.read_csv(folder / "next_experiment.csv").to_dict("records"))
    proposed = schedule(answer()["next_experiment"]["schedule"])
    np.testing.assert_array_equal(flown.times_s, proposed.times_s)
    np.testing.assert_array_equal(flown.values, proposed.values)
    assert "next_experiment.csv" in page


def test_nothing_is_asked_of_a_network_and_nothing_breaks_out(full):
    page, _ = full
    markup = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert not NETWORK.search(markup)
    assert "pool &lt;b&gt;" in page
    assert "pool <b>" not in page
    assert "three.js authors" in page


def test_bars_are_told_apart_without_colour(full):
    page, _ = full
    misfit = page[page.index('id="channels"') :].partition("</svg>")[0]
    assert "<pattern" in misfit
    assert "stroke: var(--rf-card)" in misfit


def test_the_network_check_notices_a_link():
    assert NETWORK.search('<img src="https://example.org/a.png">')
    assert not NETWORK.search('<use href="#a"/><path clip-path="url(#b)"/>')


def test_figures_are_files_too(full):
    _, folder = full
    names = {
        "misfit",
        "paths",
        "regimes",
        "ranking",
        "gain",
        "next_experiment",
        "budget",
        "run_r01",
        "run_r02",
    }
    for name in names:
        assert (folder / "figures" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert "<text" in (folder / "figures" / f"{name}.svg").read_text()


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_a_page_without_series(verdict, tmp_path):
    said = answer(verdict)
    page = write_report(said, None, tmp_path).read_text()
    for line in (headline(said).verdict, headline(said).closed, headline(said).next_step):
        assert text(line) in page
    assert 'class="rf-replay"' not in page
    assert ("Gain on held-out data" in page) == bool(said["gain"])


def test_only_what_the_words_need_is_needed(tmp_path):
    least = {"verdict": "no_misfit", "causes": [], "alternatives": [], "gain": None}
    least |= {"preconditions": [], "unexplained": []}
    assert "<h1>" in write_report(least, None, tmp_path).read_text()


def test_a_steady_table_is_shown_condition_by_condition(tmp_path):
    page = write_report(answer(), steady_series(), tmp_path).read_text()
    assert "Errors by condition" in page
    assert "f (held out)" in page
    assert 'class="rf-replay"' not in page
    assert (tmp_path / "figures" / "steady.svg").exists()


def test_the_answer_about_a_table_is_read_with_its_own_signs_and_units(tmp_path):
    said = answer(
        kind="steady",
        noise={"sensor_sd": {}, "disturbance": {"force_n2_s": 1e-6, "moment_n2_m2_s": 1e-8}},
        misfit={"curvature": {"baseline": 2.0, "extended": 1.0, "unit": "noise sd"}},
        ranking=[{"name": "servo_lag", "score": 50.0}, {"name": "added_mass", "score": -20.0}],
        floor={"worst": [{"condition": "A1", "observation": "yaw_rate", "noise_sds": -2.5}]},
    )
    said["gain"]["rmse"] = {"curvature": {"baseline": 0.2, "extended": 0.02}}
    page = write_report(said, None, tmp_path).read_text()
    assert "On the held-out condition" in page
    assert "1/m" in page
    assert "-2.5" in page
    assert "log score on conditions left out" in page
    assert "log score on runs left out" in write_report(answer(), None, tmp_path).read_text()


def test_a_quick_answer_draws_fewer_runs(tmp_path):
    series = run_series()
    page = write_report(answer(quick=True), series, tmp_path).read_text()
    assert (tmp_path / "figures" / "run_r01.svg").exists()
    assert not (tmp_path / "figures" / "run_r02.svg").exists()
    assert not (tmp_path / "figures" / "regimes.svg").exists()
    assert text(series.localisation.words()) in page
    assert [file.name for file in (tmp_path / "figures").glob("*.png")] == ["paths.png"]
    assert "figures as PNG" in QUICK.left_out
    assert any("map of where" in words for words in QUICK.left_out)
    write_report(answer(), series, tmp_path)
    assert (tmp_path / "figures" / "run_r01.png").exists()
    assert (tmp_path / "figures" / "regimes.png").exists()


def test_figures_of_an_earlier_diagnosis_go(tmp_path):
    write_report(answer(), None, tmp_path)
    assert (tmp_path / "figures" / "ranking.svg").exists()
    write_report(answer(ranking=[]), None, tmp_path)
    assert not (tmp_path / "figures" / "ranking.svg").exists()


def test_drawings_follow_the_readers_ground():
    svg = '<?xml version="1.0"?>\n<svg><metadata>m</metadata><path style="stroke: #222222"/></svg>'
    assert inline(svg) == '<svg><path style="stroke: currentColor"/></svg>'


@pytest.mark.slow
def test_series_are_predictions_of_the_two_models(tmp_path):
    from fish_env.data import load_dataset
    from fish_env.diagnosis.gain import measure_gain, one_step
    from tests.diagnosis.small_cases import small_case

    truth = small_case(tmp_path / "data", {"servo_lag": 1.0}, runs=3, duration=7.0)
    dataset = load_dataset(tmp_path / "data")
    baseline = fit(SeriesProblem(dataset, None, ("r01", "r02")), rounds=1, iterations=2)
    lag = {
        EffectParameterId("servo_lag", "time_constant"): truth.effects["servo_lag"]["time_constant"]
    }
    start = Point(np.zeros_like(baseline.point.z), lag)
    extended = fit(baseline.problem, ("servo_lag",), start, rounds=1, iterations=2)
    rng = np.random.default_rng(0)
    place = localise_fits(baseline.problem, one_step(baseline, extended), rng)
    series = series_from(dataset, baseline, extended, ("r03",), place)
    assert [run.id for run in series.runs] == ["r03", "r01", "r02"]
    assert [run.final for run in series.runs] == [True, False, False]
    judged = series.runs[0]
    error = {
        name: np.nanstd(judged.measured["yaw"] - predicted["yaw"])
        for name, predicted in (("before", judged.baseline), ("after", judged.extended))
    }
    assert error["after"] < 0.5 * error["before"]
    gap = ClosedGap(None, None)
    final = SeriesProblem(dataset, None, ("r03",))
    measured_gain = measure_gain(final, baseline, extended, gap)
    assert judged.fit_percent["extended"] == pytest.approx(measured_gain.fit_percent.extended)
    assert judged.fit_percent["baseline"] == pytest.approx(measured_gain.fit_percent.baseline)
    assert [motion.role for motion in judged.motions] == ["measured", "baseline", "extended"]
    assert np.isfinite(judged.motions[2].frames.position).all()
    alone = series_from(dataset, baseline, baseline)
    assert alone.runs[0].extended == {}
    assert len(alone.runs[0].motions) == 2


@pytest.mark.slow
@pytest.mark.long
def test_series_of_a_table_hold_its_repeats_together():
    from fish_env.data import load_dataset
    from fish_env.diagnosis.report.steady import steady_series_from
    from fish_env.identification.tables.problem import TableProblem
    from fish_env.identification.tables.table import table_of
    from fish_env.inference.estimate.fit import fit
    from fish_env.params import load_fish

    dataset = load_dataset("msu-steady")
    table = table_of(dataset)
    few = TableProblem(table, load_fish(dataset.fish), ("mass.total",)).on(np.arange(3))
    baseline = fit(few)
    series = steady_series_from(dataset, few, baseline, baseline, table.conditions[-2:])
    assert series.conditions == table.conditions
    assert series.left_out.sum() == 2
    assert series.extended == {}
    rows = table.condition_of == 0
    speed = series.measured["surge_speed"][0]
    assert speed == pytest.approx(np.nanmean(dataset.observations["surge_speed"][rows]))
    assert series.baseline["surge_speed"][:3] == pytest.approx(
        few.means(few.orbits(baseline.point))[0][:, table.observations.index("surge_speed")],
        rel=1e-3,
    )
