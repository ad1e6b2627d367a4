"""Metrics against closed forms, and intervals that cover."""

import numpy as np
import pytest

from robofish_agents.evaluation.goal_metrics import GOAL_METRICS, measure_task
from robofish_agents.evaluation.intervals import bootstrap, rate
from robofish_agents.evaluation.labels import LABELS
from robofish_agents.evaluation.metrics import METRICS, STEP_METRICS, measure
from robofish_agents.evaluation.record import KEPT, Record

PERIOD, STEPS = 0.1, 400
TIME = PERIOD * np.arange(1, STEPS + 1)
LIMITS = {"depth": 0.05, "heading": np.radians(5.0)}


def record(depth_error: np.ndarray, first: float, alive: int = STEPS, **info: float) -> Record:
    """One episode with this depth error; everything else constant."""
    constants = dict.fromkeys(KEPT, 0.0) | {"speed": 0.1, "power": 0.05} | info
    series = {key: np.full((STEPS, 1), value) for key, value in constants.items()}
    series["depth_error"] = depth_error[:, None]
    start = {key: np.array([value]) for key, value in constants.items()}
    start |= {"depth_error": np.array([first]), "heading_error": np.array([1.0])}
    lives = (np.arange(STEPS) < alive)[:, None]
    actions = np.zeros((STEPS, 1, 5))
    actions[::2] = 0.5
    weight = np.array([20.0])
    return Record(series, start, 0.9 * lives, actions, lives, PERIOD, weight, LIMITS)


def of(swum: Record) -> dict[str, float]:
    return {name: float(values[0]) for name, values in measure(swum, "hold").items()}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_first_order_response_rises_and_settles_as_it_must(sign):
    """e0 exp(-t/T): from 90 % to 10 % in T ln 9, within 5 cm after T ln(e0 / 5 cm)."""
    constant = 2.0
    got = of(record(sign * 0.2 * np.exp(-TIME / constant), sign * 0.2))
    assert got["depth_rise_s"] == pytest.approx(constant * np.log(9.0), abs=PERIOD)
    assert got["depth_settling_s"] == pytest.approx(constant * np.log(4.0), abs=PERIOD)
    assert got["depth_overshoot"] == 0.0
    assert got["depth_rmse_m"] == pytest.approx(0.2 * np.sqrt(constant / 2 / 40.0), rel=0.03)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_damped_swing_overshoots_as_it_must(sign):
    """e0 exp(-d w t) cos(w t) has its first trough near exp(-d pi)."""
    got = of(record(sign * 0.2 * np.exp(-0.2 * TIME) * np.cos(TIME), sign * 0.2))
    assert got["depth_overshoot"] == pytest.approx(np.exp(-0.2 * np.pi), rel=0.03)


def test_what_never_settles_takes_the_whole_episode():
    got = of(record(np.full(STEPS, 0.1), 0.1))
    assert got["depth_settling_s"] == got["depth_rise_s"] == pytest.approx(40.0)


def test_an_episode_that_begins_close_has_no_rise():
    got = of(record(np.full(STEPS, 0.01), 0.04))
    assert np.isnan([got["depth_rise_s"], got["depth_settling_s"], got["depth_overshoot"]]).all()


def test_power_way_and_change():
    got = of(record(np.zeros(STEPS), 0.0))
    assert got["mean_power_w"] == pytest.approx(0.05)
    assert got["cost_of_transport"] == pytest.approx(0.05 / (20.0 * 0.1))
    assert got["action_change"] == pytest.approx(0.5)
    assert got["episode_return"] == pytest.approx(0.9 * STEPS)


def test_a_failed_episode_is_no_success_and_keeps_its_last_error():
    got = of(record(np.full(STEPS, 0.3), 0.1, alive=10, is_success=1.0, failure=1.0))
    assert got["success_rate"] == 0.0
    assert got["failure_rate"] == 1.0
    assert got["depth_rmse_m"] == pytest.approx(0.3)
    assert got["depth_settling_s"] == pytest.approx(40.0)
    assert got["episode_return"] == pytest.approx(9.0)
    assert got["mean_power_w"] == pytest.approx(0.05)


def test_a_moving_goal_has_no_step_response():
    names = set(measure(record(np.zeros(STEPS), 0.0), "track"))
    assert names == set(METRICS)
    assert not names & set(STEP_METRICS)


def test_every_metric_has_a_label():
    own = {name for metrics in GOAL_METRICS.values() for name in metrics}
    assert set(LABELS) == set(METRICS) | set(STEP_METRICS) | own


def test_paths_and_places_are_measured_by_root_mean_squares():
    """Over the whole episode, and over its last 10 s; progress is that at the end."""
    swum = record(np.zeros(STEPS), 0.1, path_progress=0.7)
    late = (TIME > 30.0 + 1e-9)[:, None]
    for key in ("cross_track_error", "place_error"):
        swum.info[key] = np.where(late, -0.1, 0.3)
    path, station = (measure_task(swum, task) for task in ("path", "station"))
    whole = np.sqrt(0.75 * 0.3**2 + 0.25 * 0.1**2)
    assert path["cross_track_rmse_m"][0] == pytest.approx(whole)
    assert path["cross_track_late_rmse_m"][0] == pytest.approx(0.1)
    assert path["path_progress"][0] == 0.7
    assert station["place_rmse_m"][0] == pytest.approx(whole)
    assert station["place_late_rmse_m"][0] == pytest.approx(0.1)
    assert set(path) - set(METRICS) == set(GOAL_METRICS["path"])


def test_the_interval_covers_the_mean_as_often_as_it_says():
    """Of 200 samples of 100 episodes each, about 95 % must have the mean inside."""
    rng = np.random.default_rng(0)
    intervals = [bootstrap(rng.normal(1.0, 0.5, (1, 100))) for _ in range(200)]
    inside = sum(low <= 1.0 <= high for _, low, high in intervals)
    assert 180 <= inside <= 198


def test_seeds_that_disagree_widen_the_interval():
    rng = np.random.default_rng(0)
    alike = rng.normal(size=(5, 100))
    apart = alike + np.linspace(-2.0, 2.0, 5)[:, None]
    widths = [b.high - b.low for b in (bootstrap(alike), bootstrap(apart))]
    assert widths[1] > 3.0 * widths[0]


def test_a_rate_of_one_is_no_certainty():
    mean, low, high = rate(np.ones((1, 100)))
    assert mean == high == 1.0
    assert low == pytest.approx(1.0 / (1.0 + 1.96**2 / 100), abs=1e-3)
    assert rate(np.ones((5, 100))).low == low


def test_what_applies_to_no_episode_is_not_a_number():
    assert np.isnan(bootstrap(np.full((1, 5), np.nan)).mean)
    assert bootstrap(np.array([[np.nan, 1.0, 1.0]])) == (1.0, 1.0, 1.0)
