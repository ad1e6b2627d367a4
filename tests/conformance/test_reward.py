"""The reward: bounded, smooth, the sum of its terms, and worth what the task is about."""

import re

import numpy as np
import pytest

from fish_env.envs.config import load_env_config
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from tests.conformance import checkers
from tests.conformance.cases import (
    ALL_OPTIONS,
    REST,
    REST_ACTION,
    START,
    STEADY,
    random_actions,
    run,
)

WEIGHTS = load_env_config().tree["reward"]["weights"]
MARGINS = load_env_config().tree["reward"]["margins"]


def tolerance(error, margin):
    return 1 / (1 + (np.asarray(error) / margin) ** 2)


@pytest.mark.parametrize("options", ALL_OPTIONS.values(), ids=ALL_OPTIONS)
def test_the_reward_is_the_sum_of_the_terms_in_info(options):
    """And each term is what the class docstring says, from the errors beside it."""
    checkers.check_reward(lambda: RoboticFish3DEnv(**options))


def test_the_docstring_gives_the_formula_of_the_settings():
    """Weights, margins and the power scale in the text are those of the file."""
    text = RoboticFish3DEnv.__doc__.split("## Reward")[1].split("##")[0]
    numbers = [float(n) for n in re.findall(r"\d+\.\d+", text)]
    scale = load_env_config().tree["reward"]["power_scale"]
    pairs = [(WEIGHTS[name], MARGINS[name]) for name in ("depth", "heading", "speed")]
    costs = [WEIGHTS["power"], scale, WEIGHTS["action"]]
    assert numbers == [number for pair in pairs for number in pair] + costs


def test_depth_and_heading_dominate():
    """Either outweighs everything else that a policy could trade it for."""
    others = WEIGHTS["speed"] + WEIGHTS["power"] + WEIGHTS["action"]
    assert min(WEIGHTS["depth"], WEIGHTS["heading"]) > others
    assert WEIGHTS["depth"] + WEIGHTS["heading"] + WEIGHTS["speed"] == pytest.approx(1.0)


def terms(**goal):
    """Info of a fish at rest, level, 0.5 m deep, heading north, for a goal."""
    env = RoboticFish3DEnv()
    return env.reset(seed=0, options={"state": REST, "goal": {**STEADY, **goal}})[1]


@pytest.mark.parametrize(
    ("term", "goal", "reach", "centre"),
    [("depth", "depth", 0.4, 0.5), ("heading", "heading", np.pi, 0.0)],
)
def test_terms_fall_smoothly_all_the_way(term, goal, reach, centre):
    """Highest at no error, a slope everywhere and no jump: there is always a way up."""
    errors = np.linspace(0, reach * 0.999, 80)
    values = np.array([terms(**{goal: centre + e})[f"reward_{term}"] for e in errors])
    weight, margin = WEIGHTS[term], MARGINS[term]
    np.testing.assert_allclose(values, weight * tolerance(errors, margin), atol=1e-12)
    slopes = np.diff(values) / np.diff(errors)
    assert np.all(slopes < 0)
    assert slopes.min() > -0.66 * weight / margin
    mirrored = terms(**{goal: centre - errors[20]})[f"reward_{term}"]
    assert mirrored == pytest.approx(values[20], abs=1e-12)


def test_stopping_costs_the_speed_term_unless_the_goal_is_to_stop():
    """With a cruise speed of 0.10 m/s a fish at rest at its goal loses most of the speed term."""
    still = np.repeat(REST_ACTION[None], 20, axis=0)
    _, cruising, _ = run(RoboticFish3DEnv(), still, **START)
    stop = {"state": REST, "goal": {**STEADY, "cruise_speed": 0.0}}
    _, stopped, _ = run(RoboticFish3DEnv(), still, **stop)
    np.testing.assert_allclose(stopped, 1.0, atol=1e-3)
    loss = WEIGHTS["speed"] * (1 - tolerance(0.10, MARGINS["speed"]))
    np.testing.assert_allclose(stopped - cruising, loss, atol=2e-3)
    assert loss > 0.8 * WEIGHTS["speed"]


def test_costs_are_small_and_grow_with_what_they_cost():
    """Beating harder costs more power; jumping between extremes costs the whole action term."""
    costs = []
    for level in (-1.0, 0.0, 1.0):
        actions = np.repeat(np.array([[0, level, 0.5, 0, 0]], np.float32), 30, axis=0)
        _, _, infos = run(RoboticFish3DEnv(), actions, **START)
        costs.append(np.mean([info["cost_power"] for info in infos[10:]]))
        assert infos[-1]["cost_action"] == 0.0
    assert 0 <= costs[0] < costs[1] < costs[2] < WEIGHTS["power"]
    flips = np.ones((10, 5), np.float32) * np.array([1, -1] * 5, np.float32)[:, None]
    _, _, infos = run(RoboticFish3DEnv(), flips, **START)
    assert infos[-1]["cost_action"] == pytest.approx(WEIGHTS["action"])


def test_the_bonus_is_paid_within_the_limits_of_success():
    """Exactly there, and all else stays the same; by default there is none."""
    bonus = {"config": {"reward": {"weights": {"within": 0.5}}}}
    options = {"state": REST, "goal": {**STEADY, "cruise_speed": 0.0}}
    actions = np.repeat(REST_ACTION[None], 30, axis=0)
    actions[10:, 1:3] = 1.0  # it swims off, so that the speed leaves its limits
    _, plain, infos = run(RoboticFish3DEnv(), actions, **options)
    _, paid, _ = run(RoboticFish3DEnv(**bonus), actions, **options)
    inside = np.array([info["within_tolerance_s"] > 0.0 for info in infos[1:]])
    assert inside.any()
    assert not inside.all()
    np.testing.assert_allclose(np.subtract(paid, plain), 0.5 * inside, atol=1e-12)
    assert WEIGHTS["within"] == 0.0


def test_the_power_is_the_mean_over_the_step():
    """Energy of the tail servo gained in a control step, over its length."""
    env = RoboticFish3DEnv()
    env.reset(seed=0, options=START)
    before = env.state["tail_energy"]
    for action in random_actions(20):
        info = env.step(action)[4]
        after = env.state["tail_energy"]
        assert info["power"] == pytest.approx((after - before) / 0.1, abs=1e-12)
        assert info["power"] >= 0
        before = after


def test_success_is_being_there_for_ten_seconds():
    """is_success after ten seconds within all three tolerances; a slip starts the clock anew."""
    env = RoboticFish3DEnv()
    options = {"state": REST, "goal": {**STEADY, "cruise_speed": 0.0}}
    still = np.repeat(REST_ACTION[None], 105, axis=0)
    _, _, infos = run(env, still, **options)
    held = [info["within_tolerance_s"] for info in infos]
    np.testing.assert_allclose(held, np.arange(106) * 0.1, atol=1e-9)
    assert [info["is_success"] for info in infos] == [0.0] * 100 + [1.0] * 6
    options["goal"] |= {"heading_step": 0.2, "heading_step_time": 5.0}
    _, _, infos = run(env, still, **options)
    assert infos[49]["within_tolerance_s"] > 4.8
    assert infos[51]["within_tolerance_s"] == 0.0
    assert not any(info["is_success"] for info in infos)
