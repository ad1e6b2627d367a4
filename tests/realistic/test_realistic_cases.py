"""Realistic cases hold what they declare, and the plain tiers are as they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.params import load_fish
from tests.hidden import suite
from tests.hidden.cases import make_case as make_plain
from tests.hidden.realistic import cases, hidden, sensors
from tests.hidden.realistic.budget import ALL, STEPS, WINDOW, Windows, budget
from tests.hidden.realistic.catalogue import (
    ALONE,
    DIRT,
    MAIN_SIZES,
    NEUTRAL,
    PLANT_SIZES,
    SENSED,
    SOMETIMES,
    VARIATION,
)
from tests.hidden.realistic.faults import CLOCKS, FAULTS, far_factor
from tests.hidden.realistic.plans import RUNS, SUSPECTS, TIERS
from tests.hidden.realistic.swimming import Case, draw_run, measured_run, swimmer
from tests.hidden.realistic.truth import RealTruth
from tests.hidden.simulate import Start, simulate

NOMINAL = load_fish("zheng-2021-a")
CALM = {"colour": "ou", "force": 1e-9, "time_constant": 1.0, "inertial": False}
NOISE = dict.fromkeys(("x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r"), 1e-12)
# Cases of the plain tiers as they were before the realistic suite was added.
FINGERPRINTS = {
    ("rich", 4): -192.685975545835,
    ("null", 1): -161.38355969094843,
    ("camera", 2): -31.114031181131026,
    ("closed_loop", 1): -176.49803609634162,
    ("outside", 1): -170.73316797833883,
    ("coefficients", 1): -174.1246833888358,
    ("poor", 0): -9.611586937433646,
}


def fingerprint(folder):
    """One number of all samples and commands of a dataset; the last bits may differ by machine."""
    total = 0.0
    for run in load_dataset(folder).runs:
        values = [run.time_s, *run.channels.values(), run.commands.at(run.time_s).ravel()]
        for column in values:
            weights = np.cos(1.0 + np.arange(column.size))
            total += float(np.nansum(column * weights))
    return total


@pytest.mark.parametrize(("tier", "seed"), FINGERPRINTS)
def test_the_cases_of_the_plain_tiers_stay_the_same(tier, seed, tmp_path):
    make_plain(tier, seed, tmp_path / "case")
    assert fingerprint(tmp_path / "case") == pytest.approx(FINGERPRINTS[tier, seed], abs=1e-6)


def test_a_fingerprint_notices_the_next_case(tmp_path):
    make_plain("poor", 1, tmp_path / "case")
    assert abs(fingerprint(tmp_path / "case") - FINGERPRINTS["poor", 0]) > 1e-3


# What is drawn


@pytest.mark.parametrize("seed", range(6))
def test_a_realistic_case_holds_everything_at_once(seed):
    pieces = cases.draw_pieces("realistic_60", seed, np.random.default_rng(seed))
    roles = [one.role for one in pieces]
    assert roles.count("main") == roles.count("variation") == 1
    assert hidden.FEWEST <= roles.count("small") <= hidden.MOST
    assert {one.name for one in pieces if one.role == "dirt"} >= set(DIRT)
    assert len({one.name for one in pieces}) == len(pieces)
    assert pieces[0].name == list(MAIN_SIZES)[seed]


def strength(name, values):
    """Mean departure of an effect whose departure is its strength, in typical ones."""
    typical = MAIN_SIZES[name].typical
    return np.mean(
        [abs(values[k] - NEUTRAL[name][k]) / abs(typical[k] - NEUTRAL[name][k]) for k in typical]
    )


@pytest.mark.parametrize(("tier", "size"), [("realistic", 1), ("realistic_60", 0.6)])
def test_main_effects_have_the_declared_size_and_small_ones_a_fifth_at_most(tier, size):
    seed = list(MAIN_SIZES).index("servo_lag")
    small = []
    for repeat in range(20):
        pieces = cases.draw_pieces(tier, seed, np.random.default_rng(repeat))
        main = pieces[0].runs[0]["servo_lag"]
        assert strength("servo_lag", main) == pytest.approx(size, rel=0.16)
        small += [
            strength(one.name, one.runs[0][one.name])
            for one in pieces
            if one.role == "small" and MAIN_SIZES[one.name].strengthen is None
        ]
    assert min(small) >= 0.1 * 0.85
    assert max(small) <= 0.2 * 1.15
    assert np.mean(small) == pytest.approx(0.15, abs=0.01)


def test_runs_differ_by_the_declared_spread():
    runs = hidden.variation_piece(4000, np.random.default_rng(0)).runs
    for name, sds in VARIATION.items():
        for key, sd in sds.items():
            drawn = np.array([run[name][key] for run in runs]) - NEUTRAL[name][key]
            assert np.sqrt(np.mean(drawn**2)) == pytest.approx(sd, rel=0.05)
            assert (np.mean(drawn) > 0.5 * sd) == (name == "battery_sag")


def test_dirt_is_always_or_sometimes_there():
    drawn = [hidden.dirt_pieces([], 1, np.random.default_rng(i)) for i in range(300)]
    counts = {n: np.mean([n in {p.name for p in one} for one in drawn]) for n in SOMETIMES}
    assert all(share == pytest.approx(hidden.CHANCE, abs=0.1) for share in counts.values())
    avoided = hidden.dirt_pieces(["sensor_delay", "gyro_scale"], 1, np.random.default_rng(0))
    assert not {"sensor_delay", "gyro_scale"} & {one.name for one in avoided}
    for name, size in DIRT.items():
        for key, (low, high) in size.shape.items():
            values = [p.runs[0][name][key] for one in drawn for p in one if p.name == name]
            assert low <= min(values) < max(values) <= high


def test_what_acts_twice_adds_up_and_scales_multiply():
    pieces = [
        hidden.piece("gyro_bias", "main", {"p": 0.1, "q": 0.2, "r": 0.3}, 1),
        hidden.Piece("variation", "variation", ({"gyro_bias": {"p": 0.01},
                                                 "frequency_scale": {"scale": 1.1}},)),
        hidden.piece("frequency_scale", "small", {"scale": 0.9}, 1),
        hidden.piece("imu_lowpass", "dirt", {"cutoff": 5.0}, 1),
    ]  # fmt: skip
    total = hidden.added(0, pieces)
    assert total["gyro_bias"] == pytest.approx({"p": 0.11, "q": 0.2, "r": 0.3})
    assert total["frequency_scale"]["scale"] == pytest.approx(0.99)
    assert total["imu_lowpass"]["cutoff"] == 5.0


def test_every_effect_of_a_case_is_known_to_physics_or_sensors():
    for name in (*MAIN_SIZES, *ALONE, *PLANT_SIZES, *SOMETIMES, *VARIATION):
        assert name in NEUTRAL


# Logs


def case_of(pieces=(), fault=""):
    return Case(NOMINAL, NOMINAL, tuple(pieces), fault, 25.0, CALM)


def logged(case, run=0, seed=1):
    drawn = draw_run(case, run, np.random.default_rng(seed))
    return drawn, measured_run(case, drawn, run, NOISE, np.random.default_rng(seed))


def test_a_clean_log_is_that_of_the_physics():
    drawn, run = logged(case_of())
    states = simulate(NOMINAL.values(), drawn.commands, drawn.stamps, {},
                      Start(drawn.start.position, drawn.start.euler))  # fmt: skip
    measured = np.isfinite(run.channels["x"])
    assert np.allclose(run.channels["x"][measured], states[:, 0], atol=1e-5)
    assert np.allclose(run.channels["r"][measured], states[:, 17], atol=5e-3)


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_a_clock_that_is_off_stretches_the_whole_log(scale):
    right, plain = logged(case_of())
    off = case_of([hidden.piece("clock_scale", "suspect", {"scale": scale}, RUNS)])
    drawn, run = logged(off)
    assert np.allclose(drawn.stamps * scale, right.stamps)
    assert np.allclose(drawn.commands[:, 0] * scale, right.commands[:, 0])
    for name in ("x", "yaw", "r"):
        assert np.allclose(run.channels[name], plain.channels[name], atol=2e-3)


def test_a_skewed_clock_leaves_the_commands():
    right, _ = logged(case_of())
    off = case_of([hidden.piece("clock_skew", "suspect", {"scale": 0.5}, RUNS)])
    drawn, run = logged(off)
    assert np.allclose(drawn.commands, right.commands)
    assert np.allclose(drawn.stamps * 0.5, right.stamps)
    assert run.time_s[-1] == pytest.approx(60.0)


def test_a_beat_that_is_off_is_so_in_the_log():
    right, plain = logged(case_of())
    off = case_of([hidden.piece("frequency_scale", "suspect", {"scale": 0.3}, RUNS)])
    drawn, run = logged(off)
    assert np.allclose(drawn.commands[:, 3] * 0.3, right.commands[:, 3], atol=1e-5)
    assert np.allclose(run.channels["r"], plain.channels["r"], atol=2e-3)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_changes_the_log_and_only_it(name):
    _, right = logged(case_of())
    _, wrong = logged(case_of(fault=name))
    channels = {n for n in right.channels if not np.array_equal(right.channels[n],
                                                                wrong.channels[n])}  # fmt: skip
    commands = not np.array_equal(right.commands.values, wrong.commands.values)
    assert bool(channels) != commands
    assert set(FAULTS[name].tells) & ({*channels} | set(FAULTS[name].tells[:1]))
    if name == "sign:tail_offset":
        assert np.array_equal(wrong.commands.values[:, 0], -right.commands.values[:, 0])
    if name == "swap:p,q":
        assert np.array_equal(wrong.channels["p"], right.channels["q"])
    if name == "mirror":
        assert channels == {"y", "roll", "yaw", "p", "r"}


def test_factors_go_from_a_fifth_to_five_and_are_not_near_one():
    drawn = np.array([far_factor(np.random.default_rng(i)) for i in range(2000)])
    assert 0.2 <= drawn.min() < 0.25
    assert 4.0 < drawn.max() <= 5.0
    assert np.abs(np.log(drawn)).min() > 0.13
    assert np.mean(drawn > 1.0) == pytest.approx(0.5, abs=0.05)


def test_a_beat_may_be_off_in_single_runs():
    (only,) = cases.suspect_pieces("frequency_scale:some runs", np.random.default_rng(3))
    off = [bool(run) for run in only.runs]
    assert cases.FEWEST_OFF <= sum(off) <= cases.MOST_OFF
    assert len(off) == RUNS


# Cases


def test_a_case_is_the_same_for_the_same_seed_and_hides_its_truth(tmp_path):
    seed = SUSPECTS.index("offset_gain")
    truth = cases.make_case("suspects", seed, tmp_path / "one")
    assert cases.make_case("suspects", seed, tmp_path / "two") == truth
    for file in (tmp_path / "one").iterdir():
        text = file.read_text(encoding="utf-8")
        assert text == (tmp_path / "two" / file.name).read_text(encoding="utf-8")
        assert "offset_gain" not in text
    loaded = RealTruth.load(tmp_path / "one.truth.json")
    assert loaded == truth
    assert loaded.suspect["offset_gain"]["gain"] != 1.0


def test_noise_only_is_noise_only(tmp_path):
    cases.make_case("noise_only", 0, tmp_path / "case")
    dataset = load_dataset(tmp_path / "case")
    assert len(dataset.channels) == 9
    for run in dataset.runs:
        for channel in run.channels.values():
            seen = channel[np.isfinite(channel)]
            assert seen.std() == pytest.approx(0.3, rel=0.1)
            assert abs(np.corrcoef(seen[1:], seen[:-1])[0, 1]) < 0.15
        assert len(run.commands.times_s) > 3


def test_a_full_suite_holds_everything_and_no_tier_has_two_suites():
    todo = suite.jobs(Path("out"), tuple(suite.REALISTIC))
    seeds = {tier: [job.seed for job in todo if job.tier == tier] for tier in TIERS}
    for tier in ("realistic", "realistic_60", "suspects"):
        names = {cases.chosen(tier, seed) for seed in seeds[tier]}
        assert names == set(TIERS[tier].choices)
    assert len(seeds["noise_only"]) == 100
    assert {*ALONE, *FAULTS, *CLOCKS} == set(SUSPECTS)
    assert set(SENSED) - {"clock_offset"} <= set(SUSPECTS)
    assert not set(suite.FULL) & set(TIERS)
    assert {job.tier for job in suite.jobs(Path("out"))} == set(suite.FULL)


# Budgets


def budget_of(pieces, fish=NOMINAL):
    case = replace(case_of(pieces), fish=fish)
    drawn = [draw_run(case, run, np.random.default_rng(run)) for run in range(2)]
    return case, drawn, budget(case, drawn, dict.fromkeys(NOISE, 0.01))


def test_the_only_thing_that_acts_makes_the_whole_misfit():
    lag = hidden.piece("servo_lag", "main", {"time_constant": 0.05}, RUNS)
    idle = hidden.piece("tail_gain", "small", {"gain": 1.0}, RUNS)
    _, _, shares = budget_of([lag, idle])
    assert shares["servo_lag"][ALL] == pytest.approx(1.0, abs=1e-3)
    for other in ("tail_gain", "coefficients", "disturbance"):
        assert shares[other][ALL] == pytest.approx(0.0, abs=1e-3)


def test_two_things_share_a_misfit_by_adding_and_leaving_out():
    pieces = [
        hidden.piece("tail_gain", "main", {"gain": 0.9}, RUNS),
        hidden.piece("depth_bias", "small", {"offset": 0.05}, RUNS),
        hidden.piece("outliers", "dirt", {"share": 0.01, "size": 20.0}, RUNS),
    ]
    case, drawn, shares = budget_of(pieces)
    assert "outliers" not in shares
    windows = Windows.of(case, drawn, STEPS[0])

    def off(present):
        pairs = [(windows.channels(i, present), windows.channels(i, case.names)) for i in range(2)]
        return np.mean([np.mean((a["z"] - b["z"]) ** 2) for a, b in pairs])

    added = 1.0 - off({"depth_bias"}) / off(())
    left_out = 0.05**2 / off(())
    assert shares["depth_bias"]["z"] == pytest.approx(0.5 * (added + left_out), rel=1e-6)
    assert sum(share[ALL] for share in shares.values()) == pytest.approx(1.0, abs=0.02)


SMOOTH = {
    "frequency_scale": {"scale": 0.9},
    "clock_scale": {"scale": 1.02},
    "wake_memory": {"time_constant": 0.1},
    "servo_lag": {"time_constant": 0.05},
}
KINKED = SMOOTH | {"servo_rate_limit": {"rate": 4.0}, "servo_backlash": {"gap": 0.05}}


@pytest.mark.parametrize(("acting", "looser"), [(SMOOTH, 1.0), (KINKED, 100.0)])
def test_the_truth_that_starts_anew_is_the_truth(acting, looser):
    """In every window state, memory of the drive and phase are those of the run; kinks aside."""
    pieces = [hidden.piece(name, "small", values, RUNS) for name, values in acting.items()]
    case = case_of(pieces)
    drawn = draw_run(case, 0, np.random.default_rng(0))
    anew = Windows.of(case, [drawn], STEPS[0]).channels(0, case.names)
    fish, times = swimmer(case, drawn, 0, case.names, STEPS[0])
    motion = sensors.Motion(times, fish.run(float(times[-1]), times))
    values = case.values(0, case.names)
    whole = sensors.sampled(motion, sensors.systematic(motion, values), drawn.stamps * 1.02, values)
    for name, size in (("x", 3e-5), ("yaw", 1e-4), ("r", 2e-3)):
        assert np.abs(anew[name] - whole[name]).max() < size * looser


def test_nothing_is_left_of_an_effect_that_is_left_out():
    """A play of next to no size: what it leaves in the drive's memory would be all there is."""
    case = case_of([hidden.piece("servo_backlash", "main", {"gap": 1e-6}, RUNS)])
    drawn = draw_run(case, 1, np.random.default_rng(0))
    windows = Windows.of(case, [drawn], STEPS[0])
    without, truth = windows.channels(0, ()), windows.channels(0, case.names)
    assert np.sqrt(np.mean((without["r"] - truth["r"]) ** 2)) < 0.01
    assert np.sqrt(np.mean((without["x"] - truth["x"]) ** 2)) < 0.001


def test_a_phase_that_has_run_away_is_taken_from_the_truth_in_every_window():
    slow = hidden.piece("frequency_scale", "main", {"scale": 0.98}, RUNS)
    case = case_of([slow])
    drawn = draw_run(case, 0, np.random.default_rng(0))
    windows = Windows.of(case, [drawn], STEPS[0])
    off = [windows.channels(0, present)["yaw"] for present in ((), case.names)]
    late = slice(-int(WINDOW * 25), None)
    # After 27 s the beat alone would be half a turn behind; within a window it is not.
    assert np.abs(off[0] - off[1])[late].max() < 0.5 * np.ptp(off[1][late])
