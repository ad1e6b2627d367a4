"""The hidden-effect suite is right itself: its physics, its cases, its scores, its benchmark."""

from __future__ import annotations

import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fish_env.data import CommandSteps, load_dataset
from fish_env.effects import catalogue
from fish_env.params import load_fish
from fish_env.sensing import (
    channels_from_states,
    measured_channels,
    true_command_times,
    true_times,
)
from fish_env.simulator import InitialState, Simulator
from fish_env.steady import steady_motion
from tests import reference_model
from tests.hidden import suite
from tests.hidden.cases import draw_truth, make_case
from tests.hidden.measurement import channels_of, clock, distorted
from tests.hidden.measurement import true_times as hidden_times
from tests.hidden.plans import DESIGNS, PLANS, plan_of
from tests.hidden.scoring import score
from tests.hidden.simulate import Start, simulate
from tests.hidden.sizes import FOREIGN_SIZES, SIZES, draw_effect
from tests.hidden.steady import steady_row
from tests.hidden.stubs import perfect, silent
from tests.hidden.summary import TIERS, rate, summarise
from tests.hidden.truth import Truth

ROOT = Path(__file__).resolve().parents[2]
HIDDEN = sorted((ROOT / "tests" / "hidden").rglob("*.py"))
NOMINAL = load_fish("zheng-2021-a").values()
# It begins at rest: what servos did before the first command is not the same question.
COMMANDS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.4, 0.1, 0.35, 2.0, -0.004, 0.2],
        [1.6, -0.2, 0.5, 1.2, 0.005, -0.3],
        [2.8, 0.1, 0.3, 2.7, 0.0, 0.1],
    ]
)
TIMES = np.arange(81) * 0.05
PLACE = (0.1, 0.2, 0.4)
# Kinks and jumps that the two implementations resolve in different ways: share of the signal.
FURTHER = {
    "offset_gain": {"gain": 0.75},
    "swing_loss": {"per_radian": 0.5},
    "angle_limit": {"lower": -0.35, "upper": 0.3},
    "beat_load": {"offset": 0.25, "load": 0.012},
    "side_load": {"swing": 0.2, "beat": 0.05},
    "tail_stall": {"loss": 0.6, "onset": 1.0, "width": 0.06},
    "clock_skew": {"scale": 1.02},
    "servo_torque_limit": {"torque": 0.02},
    "surface_piercing": {"height": 0.05},
    "bubbles": {"mass": 0.004, "x": 0.04},
    "wall_effect": {"gain": 2.5, "distance": 0.4, "heading": 0.7, "range": 0.3},
    "floor_effect": {"gain": 2.5, "depth": 0.6, "range": 0.25},
}
"""Effects of the catalogue that no tier hides alone."""
SHALLOW = {"surface_piercing": (0.1, 0.2, 0.03)}
"""Where a run begins that is to show an effect; else at PLACE."""
LOOSE = {
    "tail_asymmetry": 0.02,
    "angle_limit": 0.02,
    "servo_torque_limit": 0.1,
    "tail_stall": 0.02,
    "servo_rate_limit": 0.1,
    "servo_backlash": 0.3,
}


def place_of(effects):
    return next((SHALLOW[name] for name in effects if name in SHALLOW), PLACE)


def hidden_channels(effects, place=PLACE):
    when = np.maximum(hidden_times(TIMES, effects), 0.0)
    unique, back = np.unique(when, return_inverse=True)
    given = COMMANDS.copy()
    given[:, 0] *= clock(effects)
    states = simulate(NOMINAL, given, unique, effects, Start(position=place))
    return distorted(channels_of(states[back]), effects)


def package_channels(effects, place=PLACE):
    simulator = Simulator("zheng-2021-a", dt=0.001, effects=effects)
    when = np.maximum(true_times(simulator.model, TIMES), 0.0)
    unique, back = np.unique(when, return_inverse=True)
    steps = CommandSteps(true_command_times(simulator.model, COMMANDS[:, 0]), COMMANDS[:, 1:])
    run = simulator.run(steps, sample_times_s=unique, initial=InitialState(position=place))
    return measured_channels(simulator.model, channels_from_states(run.states.T[:, back]))


def distance(one, other):
    """Root mean square difference over all channels, m and rad alike."""
    names = ("x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r")
    return float(np.sqrt(np.mean([np.mean((one[n] - other[n]) ** 2) for n in names])))


def typical(name, strength=1.0):
    if name in FURTHER:
        return {name: FURTHER[name]}
    return {name: draw_effect(name, strength, np.random.default_rng(1), 0.0)}


def test_it_shares_no_physics_with_the_package():
    """Only parameters, data and errors of the package are imported."""
    allowed = {"fish_env.params", "fish_env.data", "fish_env.data.frames", "fish_env.errors"}
    imported = {
        node.module
        for file in HIDDEN
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fish_env")
    }
    assert imported
    assert imported <= allowed


def test_the_baseline_is_that_of_the_reference():
    rows = [
        {"t": row[0], **dict(zip(reference_model.INPUT_NAMES, row[1:], strict=True))}
        for row in COMMANDS.tolist()
    ]
    times = TIMES[::10]
    reference = reference_model.simulate(NOMINAL, rows, times[-1], None, times)
    states = simulate(NOMINAL, COMMANDS, times)
    assert np.abs(states[:, :3] - reference[:, :3]).max() < 1e-7
    assert np.abs(states[:, 12:18] - reference[:, 7:13]).max() < 1e-6


@pytest.mark.parametrize("name", [name for name in [*SIZES, *FURTHER] if name in catalogue()])
def test_effects_mean_the_same_as_in_the_package(name):
    """To rounding; where motion has kinks, to a share of what the effect changes."""
    effects, place = typical(name), place_of([name])
    ours, theirs = hidden_channels(effects, place), package_channels(effects, place)
    signal = distance(ours, hidden_channels({}, place))
    assert signal > 2e-5
    assert distance(ours, theirs) < (LOOSE[name] * signal if name in LOOSE else 1e-6)


@pytest.mark.parametrize(
    "names",
    [
        ("wave", "added_mass"),
        ("wave", "tail_reactive"),
        ("wave", "current"),
        ("water_ingress", "com_offset"),
        ("clock_scale", "sensor_delay"),
        ("attitude_misalignment", "gyro_bias"),
        ("servo_lag", "servo_delay"),
        ("wall_effect", "floor_effect"),
        ("floor_effect", "surface_drag"),
        ("wall_effect", "linear_drag"),
        ("bubbles", "buoyancy_offset"),
        ("bubbles", "com_offset"),
        ("surface_piercing", "bubbles"),
        ("surface_piercing", "added_mass"),
        ("surface_piercing", "wave"),
    ],
    ids=" + ".join,
)
def test_pairs_mean_the_same_as_in_the_package(names):
    """Effects that couple, acting together."""
    both = {name: typical(name)[name] for name in names}
    place = place_of(names)
    assert distance(hidden_channels(both, place), package_channels(both, place)) < 1e-6


def test_the_comparison_notices_a_slightly_different_effect():
    ours = hidden_channels({"servo_lag": {"time_constant": 0.050}})
    theirs = package_channels({"servo_lag": {"time_constant": 0.0501}})
    assert distance(ours, theirs) > 1e-5


@pytest.mark.parametrize("name", [*SIZES, *FOREIGN_SIZES])
def test_every_effect_changes_the_motion_or_its_record(name):
    deep = (0.0, 0.0, 1.0)
    assert distance(hidden_channels(typical(name), deep), hidden_channels({}, deep)) > 2e-5


def test_a_current_only_carries_the_motion_along():
    flow = np.array([0.05, -0.03, 0.01])
    effects = {"current": dict(zip(("north", "east", "down"), flow, strict=True))}
    still = simulate(NOMINAL, COMMANDS, TIMES)
    carried = simulate(NOMINAL, COMMANDS, TIMES, effects, Start(velocity=tuple(flow)))
    drift = carried[:, :3] - still[:, :3] - TIMES[:, None] * flow
    assert np.abs(drift).max() < 1e-9


@pytest.mark.parametrize(("scale", "still"), [(1.0, True), (0.0, False)])
def test_a_moved_block_leaves_the_centre_of_mass_where_it_was(scale, still):
    """Nothing from outside acts without water and weight; the baseline lets the centre jump.

    Nearly so: the weight itself is put at its commanded place at once, as in the baseline.
    """
    fish = NOMINAL | {"water.density": 0.0, "water.gravity": 0.0}
    fish |= {f"body.rotational_damping[{i}]": 0.0 for i in range(3)}
    moves = np.array([[0.0, 0, 0, 0, 0, 0], [0.5, 0, 0, 0, 0.01, 0], [1.0, 0, 0, 0, 0.01, 0.6]])
    states = simulate(fish, moves, TIMES, {"block_reaction": {"scale": scale}})
    shift = np.where(TIMES > 0.5 + 1e-9, 0.01, 0.0)
    turn = np.where(TIMES > 1.0 + 1e-9, 0.6, 0.0)
    block = fish["mass.weight_block"]
    moved = np.column_stack([-shift, 0.02 * np.sin(turn), 0.02 * (np.cos(turn) - 1.0)])
    centre = np.array([0.0, 0.0, 0.006]) + block / fish["mass.total"] * moved
    rotation = states[:, 3:12].reshape(-1, 3, 3)
    path = states[:, :3] + np.einsum("tij,tj->ti", rotation, centre)
    settled = (TIMES < 0.5) | ((TIMES > 0.75) & (TIMES < 1.0)) | ((TIMES > 1.25) & (TIMES < 1.5))
    assert (np.ptp(path[settled], axis=0).max() < 6e-4) == still


def test_a_case_is_the_same_for_the_same_seed_and_hides_its_truth(tmp_path):
    truth = make_case("rich", 3, tmp_path / "one")
    assert make_case("rich", 3, tmp_path / "two") == truth
    files = sorted(file.name for file in (tmp_path / "one").iterdir())
    assert files == sorted(["dataset.yaml", *(f"r{i:02d}.csv" for i in range(1, 9))])
    for name in files:
        text = (tmp_path / "one" / name).read_text(encoding="utf-8")
        assert text == (tmp_path / "two" / name).read_text(encoding="utf-8")
        assert "servo_lag" not in text
        assert "rich" not in text
    assert Truth.load(tmp_path / "one.truth.json") == truth
    dataset = load_dataset(tmp_path / "one")
    assert dataset.fish in ("zheng-2021-a", "zheng-2021-b")
    assert all(run.start == "rest" and run.tail_phase == 0.0 for run in dataset.runs)


@pytest.mark.parametrize("tier", ["camera", "closed_loop", "poor"])
def test_cases_of_other_tiers_can_be_read(tier, tmp_path):
    make_case(tier, 1, tmp_path / "case")
    dataset = load_dataset(tmp_path / "case")
    assert dataset.notes == ()
    assert set(dataset.channels) == set(plan_of(tier, 1).noise)


def test_steady_rows_mean_what_the_package_means_by_steady():
    command = np.array([-0.4, 0.3, 1.5, 0.003, 0.0])
    calm = {"colour": "ou", "force": 1e-12, "time_constant": 1.0, "inertial": True}
    truth = Truth("steady", 0, "zheng-2021-a", disturbance=calm)
    fish = load_fish("zheng-2021-a")
    row = steady_row(truth, fish, command, np.random.default_rng(0))
    steady = steady_motion(fish, command[None])
    for name, value in row.items():
        assert value == pytest.approx(steady[name][0], abs=1e-4)


def drawn(tier, seed=0):
    """A truth without its runs."""
    plan = plan_of(tier, seed)
    truth = draw_truth(tier, seed, plan, None, np.random.default_rng(seed))
    moved = {"tail.drag.c2": 3.3} if plan.moved else {}
    return replace(truth, moved=moved, coefficients=NOMINAL | moved)


@pytest.mark.parametrize("tier", PLANS)
@pytest.mark.parametrize("seed", [0, 5])
def test_the_right_answer_scores(tier, seed):
    truth = drawn(tier, seed)
    row = score(truth, perfect(truth))
    assert row.verdict_right
    assert row.name_right
    assert (row.wrong_single, row.false_alarm, row.partial) == (False, False, False)
    assert all(error < 1e-9 for error in row.errors.values())
    assert all(row.covered.values())


def test_wrong_answers_do_not():
    truth = drawn("rich", list(SIZES).index("servo_lag"))
    right = perfect(truth)
    assert not score(truth, silent("")).verdict_right
    wrong = right | {"causes": [{"name": "servo_delay", "parameters": {}}]}
    assert score(truth, wrong).wrong_single
    assert not score(truth, wrong).name_right
    more = right | {"causes": [*right["causes"], {"name": "current", "parameters": {}}]}
    assert score(truth, more).partial
    unsure = right | {"verdict": "ambiguous", "alternatives": [[{"name": "servo_delay"}]]}
    assert score(truth, unsure).set_right
    assert not score(truth, unsure).verdict_right
    causes = json.loads(json.dumps(right["causes"]))
    causes[0]["parameters"]["time_constant"] |= {"estimate": 0.1, "ci95": [0.09, 0.11]}
    off = score(truth, right | {"causes": causes})
    assert off.errors["servo_lag.time_constant"] > 0.5
    assert off.covered == {"servo_lag.time_constant": False}


def test_alarms_and_names_without_ground_are_counted():
    alarm = {"verdict": "cause", "causes": [{"name": "tether", "parameters": {}}]}
    nothing = score(drawn("null"), alarm)
    assert nothing.false_alarm
    assert nothing.wrong_single
    assert score(drawn("outside"), alarm).wrong_single
    assert score(drawn("poor"), alarm).wrong_single


def test_an_equal_parameter_counts_as_the_effect():
    truth = drawn("rich", list(SIZES).index("buoyancy_offset"))
    answer = {"verdict": "parameters", "causes": [{"name": "parameter:mass.buoyancy"}]}
    assert score(truth, answer).name_right
    assert not score(truth, answer | {"causes": [{"name": "parameter:mass.total"}]}).name_right


def test_no_misfit_on_poor_runs_must_say_what_was_not_excited():
    truth = drawn("poor")
    entry = {"name": next(iter(truth.effects))}
    quiet = silent("")
    assert not score(truth, quiet).verdict_right
    assert not score(truth, quiet | {"preconditions": [entry | {"excited": True}]}).verdict_right
    assert score(truth, quiet | {"preconditions": [entry | {"excited": False}]}).verdict_right


def test_sizes_are_compared_with_the_published_smallest():
    truth = drawn("small", list(SIZES).index("servo_lag"))
    size = truth.effects["servo_lag"]["time_constant"]
    entry = {"name": "servo_lag", "smallest_detectable": {"time_constant": size / 2}}
    assert score(truth, perfect(truth) | {"preconditions": [entry]}).above_detectable == 2.0


def test_what_is_off_at_infinity_is_larger_where_it_is_less():
    truth = drawn("small", list(SIZES).index("servo_rate_limit"))
    rate = truth.effects["servo_rate_limit"]["rate"]
    entry = {"name": "servo_rate_limit", "smallest_detectable": {"rate": 3.0 * rate}}
    found = score(truth, perfect(truth) | {"preconditions": [entry]}).above_detectable
    assert found == pytest.approx(3.0)


def test_moved_coefficients_are_compared_too():
    """The least of all counts; one that could not be found at any size leaves no ratio."""
    truth = drawn("coefficients")
    sizes = {"smallest_detectable": 0.25, "nominal": 0.0}
    entries = [{"name": f"parameter:{path}", **sizes} for path in truth.moved]
    least = min(abs(value) for value in truth.moved.values())
    assert score(truth, silent("") | {"parameters": entries}).above_detectable == 4.0 * least
    entries[0]["smallest_detectable"] = None
    assert score(truth, silent("") | {"parameters": entries}).above_detectable is None


def test_rates_carry_exact_intervals():
    """Clopper-Pearson: of none in 30, the upper end is 1 - 0.025^(1/30)."""
    none = rate([False] * 30)
    assert none["low"] == 0.0
    assert none["high"] == pytest.approx(1.0 - 0.025 ** (1 / 30))


def test_a_summary_counts_each_tier_and_answer():
    rows = [score(drawn(tier, seed), silent("")) for tier in ("rich", "null") for seed in (3, 4)]
    summary = summarise(rows)
    assert summary["tiers"]["rich"]["name_right"]["count"] == 0
    assert summary["tiers"]["null"]["name_right"]["count"] == 2
    assert summary["tiers"]["null"]["false_alarm"]["of"] == 2
    assert summary["confusion"]["rich"]["servo_lag"] == {"no_misfit": 1}


def test_a_full_suite_holds_what_it_must():
    todo = suite.jobs(Path("out"))
    count = {tier: sum(job.tier == tier for job in todo) for tier in PLANS}
    assert len({job.file for job in todo}) == len(todo) >= 100
    for tier in ("rich", "small"):
        hidden = {tuple(drawn(tier, job.seed).effects) for job in todo if job.tier == tier}
        assert hidden == {(name,) for name in SIZES}
    assert set(TIERS) == set(count) == set(suite.FULL)
    assert count["null"] >= 30
    assert min(count["coefficients"], count["pairs"], count["outside"]) >= 12
    assert count["poor"] >= 8
    for tier in ("designs", "null_designs"):
        plans = [plan_of(tier, job.seed) for job in todo if job.tier == tier]
        for plan in DESIGNS.values():
            assert replace(plan, choices=PLANS[tier].choices) in plans
