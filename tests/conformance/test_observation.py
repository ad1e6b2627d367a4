"""The observation: its table, its numbers, its noise, its delay, its heading over a beat."""

import numpy as np
import pytest

from fish_env.envs.layout import OBSERVATION, SENSORS
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.simulator import InitialState, Simulator
from tests.conformance import checkers
from tests.conformance.cases import (
    IDEAL,
    MOVING_GOAL,
    REST_ACTION,
    START,
    STEADY,
    random_actions,
    run,
    swim_action,
    table,
)
from tests.conformance.reference_observation import declared_scales, rotation, wrapped

FINE = {"control_hz": 100.0, "physics_hz": 100.0}


def test_the_docstring_and_the_layout_say_the_same():
    """Every index once, in order, with the scale that the layout declares."""
    at = 0
    for indices, what, scale in table("Observation space"):
        first, last = (int(n) for n in (indices.split("-") * 2)[:2])
        assert first == at
        for index in range(first, last + 1):
            assert OBSERVATION[index][1] == scale
        if first == last:
            assert OBSERVATION[first][0] == what
        at = last + 1
    assert at == len(OBSERVATION)
    assert RoboticFish3DEnv().observation_space.shape == (at,)


CASES = {
    "plain": {},
    "with zero noise": {"observation_noise": {"depth": 0.0}},
    "delayed": {"observation_delay_s": 0.13},
    "in moving water": {
        "current": (0.05, -0.08, 0.02),
        "effects": {"servo_lag": {"time_constant": 0.06}},
    },
}


@pytest.mark.parametrize("options", CASES.values(), ids=CASES)
def test_every_number_is_what_its_row_says(options):
    """Recomputed in NumPy from the true state, actuators and goal, while everything moves."""
    steps = round(options.get("observation_delay_s", 0.0) * 100)
    checkers.check_observation_values(
        lambda: RoboticFish3DEnv(**FINE, **options), MOVING_GOAL, steps
    )


def test_observations_stay_in_their_space():
    """Clipped to a finite range even for a fish that spins wildly."""
    checkers.check_observations(RoboticFish3DEnv)
    env = RoboticFish3DEnv()
    state = {"angular_velocity_body": [0.0, 0.0, 50.0], "velocity_body": [9.0, -9.0, 0.0]}
    obs, _ = env.reset(seed=0, options={"state": state})
    assert obs[20] == 10.0
    assert (obs[15], obs[16]) == (10.0, -10.0)
    assert obs in env.observation_space


def test_zero_noise_is_no_noise():
    """To the last bit."""
    actions = random_actions(30)
    plain, *_ = run(RoboticFish3DEnv(), actions)
    silent, *_ = run(RoboticFish3DEnv(observation_noise={"attitude": 0.0, "depth": 0.0}), actions)
    np.testing.assert_array_equal(plain, silent)


SD = dict(zip(SENSORS, np.arange(1, 12) / 100, strict=True))
"""A different standard deviation for each sensor, in SI units."""
LINEAR = {"depth": 3, "depth_rate": 1, "u": 15, "v": 16, "w": 17, "p": 18, "q": 19, "r": 20}
ANGLES = {"roll": 11, "pitch": 13, "heading": 6}


def angle(obs: np.ndarray, index: int) -> np.ndarray:
    """Angle whose sine and cosine stand at an index and the next."""
    return np.arctan2(obs[:, index], obs[:, index + 1])


def residuals(noise: dict[str, float], steps: int = 2000) -> dict[str, np.ndarray]:
    """What noise adds to each sensor of a fish that swims, in SI units."""
    config = {"tank": {"depth": 20.0}, "goal": {"depth": [9.0, 11.0]}}
    clean, noisy = (RoboticFish3DEnv(config=config, observation_noise=n) for n in (None, noise))
    action = swim_action(clean.options.config, tail_amplitude=0.3, tail_frequency=2.0)
    actions = np.repeat(action[None], steps, axis=0)
    (true, _, truth), (seen, _, same) = (run(env, actions) for env in (clean, noisy))
    assert truth == same, "info and reward must see the truth"
    added = (seen.astype(float) - true) * declared_scales()
    off = {name: added[:, i] for name, i in LINEAR.items()}
    off["depth"] *= (clean.options.config.bottom - clean.options.config.top) / 2
    turned = {i: np.angle(np.exp(1j * (angle(seen, i) - angle(true, i)))) for i in (4, 6, 11, 13)}
    off |= {name: turned[i] for name, i in ANGLES.items()}
    np.testing.assert_allclose(added[:, 0], -off["depth"], atol=1e-5)
    np.testing.assert_allclose(added[:, 9], -off["u"], atol=1e-5)
    np.testing.assert_allclose(turned[4], turned[6], atol=1e-5)
    return {name: off[name] for name in SENSORS}


def test_noise_has_the_stated_deviation_and_is_white():
    """Each sensor its own, independent of the others and of the step before; info stays true."""
    off = np.array(list(residuals(SD).values()))
    count = off.shape[1]
    sd = np.array(list(SD.values()))
    np.testing.assert_allclose(off.std(1), sd, rtol=4 / (2 * count) ** 0.5)
    assert np.all(np.abs(off.mean(1)) < 4 * sd / count**0.5)
    assert np.abs(np.corrcoef(off) - np.eye(len(off))).max() < 4.5 / count**0.5
    for row in off:
        assert abs(np.corrcoef(row[1:], row[:-1])[0, 1]) < 4.5 / count**0.5


def test_noise_on_one_sensor_leaves_the_others_alone():
    """What is not named stays exact."""
    off = residuals({"heading": 0.05}, 50)
    assert off.pop("heading").std() == pytest.approx(0.05, rel=0.5)
    assert all(np.abs(row).max() < 1e-6 for row in off.values())


@pytest.mark.parametrize("delay", [0.1, 0.13, 0.5, 2.0])
def test_a_delayed_observation_is_the_earlier_one(delay):
    """To the last bit, also between control steps; commands and their phase are known at once."""
    checkers.check_observation_delay(RoboticFish3DEnv, delay)


def test_before_the_start_a_delayed_sensor_shows_the_start():
    """A delay reaches back before the episode; it then shows the first state."""
    env = RoboticFish3DEnv(observation_delay_s=0.5)
    obs, *_ = run(env, random_actions(8), seed=4, goal=STEADY)
    np.testing.assert_array_equal(
        obs[:6, checkers.SENSED], np.tile(obs[0, checkers.SENSED], (6, 1))
    )
    assert not np.array_equal(obs[6, checkers.SENSED], obs[0, checkers.SENSED])


def test_heading_over_a_beat_is_the_mean_of_a_fine_trajectory():
    """From an independent run at 1 kHz: mean heading vector and surge over the last beat."""
    frequency, time = 1.7, np.arange(0, 4.0005, 0.001)
    env = RoboticFish3DEnv(config=IDEAL)
    action = swim_action(
        env.options.config, tail_offset=0.1, tail_amplitude=0.4, tail_frequency=frequency
    )
    commands = {"t": 0.0, "tail_offset": 0.1, "tail_amplitude": 0.4, "tail_frequency": frequency}
    start = InitialState(position=(0.0, 0.0, 0.5))
    fine = Simulator("zheng-2021-a", 0.001).run([commands], initial=start, sample_times_s=time)
    turns = np.array([rotation(*q)[:2, 0] for q in fine.states[:, 3:7]])
    levels = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    _, _, infos = run(env, np.repeat(action[None], 40, axis=0), **START)
    for step in (10, 25, 40):
        end = step / 10
        grid = np.linspace(end - 1 / frequency, end, 2001)
        means = [np.interp(grid, time, row).mean() for row in (*levels.T, fine["u"])]
        heading = np.arctan2(means[1], means[0])
        assert wrapped(infos[step]["heading"] - heading) == pytest.approx(0, abs=2e-4)
        assert infos[step]["speed"] == pytest.approx(means[2], abs=2e-4)


def test_the_beat_mean_is_calm_while_the_heading_swings():
    """A fish that swims straight: its heading swings by degrees, the mean over a beat does not."""
    env = RoboticFish3DEnv(**FINE, config={"tank": {"depth": 3.0}, "goal": {"depth": [1.4, 1.6]}})
    action = swim_action(env.options.config, tail_amplitude=0.5, tail_frequency=1.7)
    start = {"state": {**START["state"], "position": [0, 0, 1.5]}, "goal": {"heading": 0.0}}
    _, _, infos = run(env, np.repeat(action[None], 3000, axis=0), **start)
    late = infos[2000:]
    swing = np.degrees(np.ptp(np.unwrap([info["heading_error_instant"] for info in late])))
    mean = np.degrees(np.ptp(np.unwrap([info["heading_error"] for info in late])))
    print(f"instantaneous heading swings by {swing:.2f} degrees, the beat mean by {mean:.3f}")
    assert swing > 3.0
    assert mean < 0.05 * swing


def test_a_still_tail_averages_over_the_longest_window():
    """At 0.67 Hz and slower, the last 1.5 s; at rest heading and speed are what they are."""
    env = RoboticFish3DEnv(**FINE)
    state = {**START["state"], "euler": [0.0, 0.0, 1.0]}
    obs, _, infos = run(env, np.repeat(REST_ACTION[None], 50, axis=0), state=state, goal=STEADY)
    assert infos[-1]["heading_error"] == pytest.approx(-1.0, abs=1e-3)
    assert infos[-1]["heading_error_instant"] == pytest.approx(-1.0, abs=1e-3)
    assert obs[-1, 9] == pytest.approx(1.0, abs=1e-3)
