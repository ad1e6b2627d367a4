"""The PID controller: its signs, and that it holds depth, heading and speed."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import fish_env  # noqa: F401
from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from robofish_agents.controllers import PIDController, PIDGains
from robofish_agents.controllers.pid import load_gains, tuned_gains
from robofish_agents.controllers.seen import Seen
from robofish_agents.episode import Episode, swim

SEEDS = range(100, 120)
NAMES = [name for name, _ in OBSERVATION]
OFFSET, AMPLITUDE, FREQUENCY, DISPLACEMENT, ANGLE = range(5)


def act(obs: np.ndarray) -> np.ndarray:
    return PIDController().act(obs[None])[0]


def observation(**errors: float) -> np.ndarray:
    """A level fish at 0.1 m/s, on its goals except for the given errors (scaled)."""
    obs = np.zeros(len(OBSERVATION), np.float32)
    for name, value in {
        "cosine of the heading error over the last beat": 1.0,
        "goal speed": 1.0,
        "cosine of roll": 1.0,
        "cosine of pitch": 1.0,
        "surge speed over ground, body frame": 0.5,
    }.items():
        obs[NAMES.index(name)] = value
    for part, value in errors.items():
        (index,) = (i for i, name in enumerate(NAMES) if name.startswith(part.replace("_", " ")))
        obs[index] = value
    return obs


@pytest.mark.parametrize(
    ("error", "action"),
    [("depth_error", DISPLACEMENT), ("sine_of_the_heading_error_over", OFFSET)],
)
def test_the_actuators_that_turn_the_fish_act_against_the_sign_of_the_error(error, action):
    """Goal deeper: block forward, nose down. Goal to starboard: negative offset, positive yaw."""
    above, below = (act(observation(**{error: e}))[action] for e in (0.2, -0.2))
    assert above < 0.0 < below
    assert above == pytest.approx(-below)


def test_a_slow_fish_beats_faster():
    slow, fast = (act(observation(speed_error=e))[FREQUENCY] for e in (0.3, -0.3))
    assert slow > fast


def test_actions_are_in_range_and_finite_whatever_is_seen():
    controller, rng = PIDController(), np.random.default_rng(0)
    controller.reset(7)
    for _ in range(200):
        actions = controller.act(rng.uniform(-10.0, 10.0, (7, len(OBSERVATION))))
        assert actions.dtype == np.float32
        assert actions.shape == (7, 5)
        assert np.all(np.abs(actions) <= 1.0)


def test_reset_forgets_the_integrals():
    controller, obs = PIDController(), observation(depth_error=0.3, speed_error=0.5)[None]
    first = controller.act(obs)
    assert not np.array_equal(controller.act(obs), first)
    controller.reset(1)
    np.testing.assert_array_equal(controller.act(obs), first)


def test_every_fish_has_integrals_of_its_own():
    errors = np.stack([observation(depth_error=e, speed_error=0.5) for e in (0.3, -0.1, 0.0)])
    together, alone = PIDController(), [PIDController() for _ in errors]
    together.reset(len(errors))
    for _ in range(50):
        actions = together.act(errors)
        for lane, controller in enumerate(alone):
            np.testing.assert_array_equal(controller.act(errors[[lane]])[0], actions[lane])


def test_gains_that_lack_a_number_are_refused(tmp_path):
    file = tmp_path / "pid.yaml"
    file.write_text("gains: {depth: 1.0, deep: 2.0}\n")
    with pytest.raises(ConfigError, match=r"pid\.yaml.*'deep', 'depth_integral'"):
        load_gains(file)


def test_observations_of_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"\(N, 33\)"):
        Seen.of(np.zeros(33))


def held(episode: Episode) -> bool:
    """Within 5 cm, 5 degrees over a beat and 20 % of the speed throughout the last 10 s."""
    end = episode.last(10.0)
    return (
        len(end["depth"]) == 100
        and end.worst("depth_error") < 0.05
        and end.worst("heading_error") < np.radians(5.0)
        and bool(np.all(np.abs(end["speed_error"]) < 0.2 * end["goal_speed"]))
    )


def swims(gains: PIDGains | None = None, **options: object) -> list[Episode]:
    env = gym.make(ENV_ID, **options)
    return [swim(env, PIDController(gains), seed) for seed in SEEDS]


def test_it_holds_depth_heading_and_speed_from_every_start():
    episodes = swims()
    assert all(held(episode) for episode in episodes)
    assert all(episode.succeeded for episode in episodes)


@pytest.mark.parametrize("broken", [{"heading": -1.2}, {"pitch": -3.4}, {"frequency": -0.8}])
def test_a_controller_with_a_wrong_sign_does_not_hold(broken):
    """The check above notices: each broken gain loses what it is there for."""
    gains = replace(tuned_gains(), **broken, speed_integral=0.0)
    assert not any(held(episode) for episode in swims(gains))


def test_it_does_not_say_success_before_ten_seconds():
    env = gym.make(ENV_ID, max_episode_steps=99)
    assert not swim(env, PIDController(), 0).succeeded
