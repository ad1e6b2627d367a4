"""Goals and starts of episodes: what a task draws, and where the fish begins."""

import numpy as np
import pytest

from fish_env.envs.config import load_env_config
from fish_env.envs.layout import GOAL, REFERENCE
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.tasks import GOAL_DRAWS, TASKS
from fish_env.envs.vector import RoboticFish3DVectorEnv

COUNT = 4000


def goals(task: str, config=None) -> tuple[np.ndarray, object]:
    """Goal rows (len(GOAL), COUNT) of a task, and the settings."""
    settings = load_env_config(config)
    fields = TASKS[task](settings, np.random.default_rng(0).random((GOAL_DRAWS, COUNT)))
    assert set(fields) <= set(GOAL)
    return {name: np.broadcast_to(fields.get(name, 0.0), COUNT) for name in GOAL}, settings


def signal(rows: dict[str, np.ndarray], channel: str, times: np.ndarray) -> np.ndarray:
    """Goal signals (times, COUNT)."""
    g = {name: rows[f"{channel}_{name}"] for name in REFERENCE}
    t = times[:, None]
    ramp = np.clip(t, g["ramp_start"], g["ramp_end"]) - g["ramp_start"]
    sine = np.sin(2 * np.pi * g["sine_frequency"] * t + g["sine_phase"])
    step = g["step"] * (t >= g["step_time"])
    return g["base"] + step + g["ramp_rate"] * ramp + g["sine_amplitude"] * sine


def test_hold_keeps_its_goal():
    """Constant depth in its range, any heading, the cruise speed of the settings."""
    rows, config = goals("hold", {"goal": {"cruise_speed": [0.05, 0.15]}})
    times = np.linspace(0, 40, 50)
    for channel, (low, high) in {
        "depth": config.tree["goal"]["depth"],
        "heading": (-np.pi, np.pi),
    }.items():
        values = signal(rows, channel, times)
        assert np.ptp(values, axis=0).max() == 0
        assert low <= values.min() < low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) < values.max() <= high
    assert 0.05 <= rows["cruise_speed"].min() < 0.051
    assert 0.149 < rows["cruise_speed"].max() <= 0.15


@pytest.mark.parametrize("config", [None, {"goal": {"depth": [0.1, 0.12]}}])
def test_track_moves_its_goals_inside_the_tank(config):
    """Each channel steps, ramps or swings, both ways, and the depth goal stays in the tank."""
    rows, settings = goals("track", config)
    times = np.linspace(0, 60, 400)
    depth = signal(rows, "depth", times)
    assert depth.min() > settings.top
    assert depth.max() < settings.bottom
    for channel in ("depth", "heading"):
        kinds = np.array(
            [rows[f"{channel}_{k}"] != 0 for k in ("step", "ramp_rate", "sine_amplitude")]
        )
        np.testing.assert_array_equal(kinds.sum(axis=0), 1)
        np.testing.assert_allclose(kinds.mean(axis=1), 1 / 3, atol=0.03)
        moved = np.ptp(signal(rows, channel, times), axis=0)
        assert np.all(moved > 0)
        for kind in ("step", "ramp_rate", "sine_amplitude"):
            values = rows[f"{channel}_{kind}"]
            upward = np.mean(values[values != 0] > 0)
            assert upward == pytest.approx(0.5, abs=0.05) or config is not None


def test_depth_and_heading_move_independently():
    """Which signal the one takes says nothing of the other."""
    rows, _ = goals("track")
    steps = [rows[f"{channel}_step"] != 0 for channel in ("depth", "heading")]
    assert np.mean(steps[0] & steps[1]) == pytest.approx(1 / 9, abs=0.02)


@pytest.mark.parametrize("task", TASKS)
def test_starts_are_what_the_docstring_says(task):
    """Within 0.2 m and 90 degrees of the goal, up to 0.1 m/s, a little tilted, at (0, 0)."""
    env = RoboticFish3DVectorEnv(2000, task=task)
    _, infos = env.reset(seed=0)
    assert 0.15 < np.abs(infos["depth_error"]).max() <= 0.2 + 1e-9
    base = env.batch._data[env.batch._rows.ROW_GOAL + GOAL.index("heading_base")]
    off = np.abs(np.angle(np.exp(1j * (base - infos["heading"]))))
    assert 1.5 < off.max() <= np.pi / 2 + 1e-9
    assert 0.0 <= infos["speed"].min() < 0.01 < 0.09 < infos["speed"].max() <= 0.1
    assert np.all(infos["north"] == 0)
    assert np.all(infos["east"] == 0)
    np.testing.assert_array_equal(env.batch.inputs, 0.0)
    phase = env.batch.state[13]
    assert 0 <= phase.min() < 0.1 < 6.2 < phase.max() < 2 * np.pi
    tilt = np.arccos(1 - 2 * (env.batch.state[4] ** 2 + env.batch.state[5] ** 2))
    assert 0.1 < tilt.max() < 0.15


def test_cruise_speed_is_an_option_and_may_be_zero():
    """A number, a range, or nothing at all to do but stay."""
    for given, low, high in ((0.0, 0.0, 0.0), (0.07, 0.07, 0.07), ((0.05, 0.1), 0.05, 0.1)):
        env = RoboticFish3DEnv(cruise_speed=given)
        speeds = [env.reset(seed=seed)[1]["goal_speed"] for seed in range(20)]
        assert low <= min(speeds) <= max(speeds) <= high
        assert (np.ptp(speeds) > 0) == (high > low)
    assert RoboticFish3DEnv().reset(seed=0)[1]["goal_speed"] == 0.10
