"""What the constructor and ``reset`` take, and what they refuse and how."""

import numpy as np
import pytest

from fish_env.envs.options import env_options
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, EffectError, ParameterError
from fish_env.params.io import load_fish

REFUSED = [
    ({"task": "swim"}, ConfigError, "unknown task 'swim': choose one of hold, track"),
    ({"fish": "tuna"}, ParameterError, "tuna"),
    ({"cruise_speed": -0.1}, ConfigError, "cruise_speed -0.1: a speed >= 0"),
    ({"cruise_speed": np.inf}, ConfigError, "cruise_speed"),
    ({"cruise_speed": (0.2, 0.1)}, ConfigError, "cruise_speed"),
    ({"effects": {"curent": {}}}, EffectError, "did you mean 'current'"),
    ({"effects": {"current": {"west": 1}}}, EffectError, "no parameter 'west'"),
    ({"effects": {"servo_lag": {"time_constant": 1e-5}}}, EffectError, "use dt <= 1e-05"),
    ({"current": (0.1, 0.2)}, ConfigError, "current .*: three speeds"),
    ({"current": "abc"}, ConfigError, "three speeds"),
    ({"current": (np.nan, 0, 0)}, ConfigError, "three speeds"),
    (
        {"current": (0.1, 0, 0), "effects": {"current": {"north": 0.2}}},
        ConfigError,
        "current is given twice",
    ),
    ({"wave": {"height": 1}}, EffectError, "no parameter 'height'"),
    ({"wave": 0.1}, ConfigError, "wave 0.1: a mapping"),
    ({"observation_noise": {"depht": 0.1}}, ConfigError, "'depht'.*any of depth"),
    ({"observation_noise": {"depth": -0.1}}, ConfigError, "standard deviation >= 0"),
    ({"observation_noise": {"depth": "x"}}, ConfigError, "standard deviation >= 0"),
    ({"observation_delay_s": 0.015}, ConfigError, "not a whole number of physics steps"),
    ({"action_delay_s": -0.1}, ConfigError, "between 0 and 2 s"),
    ({"action_delay_s": np.nan}, ConfigError, "between 0 and 2 s"),
    (
        {"effects": {"depth_bias": {"offset": 0.1}}},
        ConfigError,
        "change recordings, not the motion",
    ),
    (
        {"config": {"actuators": {"block_displacement": {"high": 0.05}}}},
        ConfigError,
        "beyond the crank's reach",
    ),
]


@pytest.mark.parametrize(("options", "error", "message"), REFUSED, ids=[str(r[0]) for r in REFUSED])
def test_wrong_options_are_refused_by_name(options, error, message):
    """Each error is of the kind the package promises, and says what to change."""
    with pytest.raises(error, match=message):
        env_options(**options)


@pytest.mark.parametrize("make", [RoboticFish3DEnv, RoboticFish3DVectorEnv])
def test_unknown_keywords_and_pictures_are_refused(make):
    """Nothing that a user asks for is dropped in silence."""
    with pytest.raises(TypeError, match="curent"):
        make(curent=(0.1, 0, 0))
    with pytest.raises(ConfigError, match="render_mode 'ansi': choose None or one of human"):
        make(render_mode="ansi")
    with pytest.raises(ConfigError, match="render_size"):
        make(render_size=(0, 480))


def test_noise_groups_and_sensors():
    """A group sets all of its sensors; a sensor named after it wins."""
    sd = env_options(observation_noise={"velocity": 0.02, "v": 0.03}).noise_sd
    np.testing.assert_array_equal(sd, [0, 0, 0, 0, 0, 0.02, 0.03, 0.02, 0, 0, 0])


def test_effects_in_the_water_are_switched_on():
    """current and wave are short for two effects; a calm sea needs no other kernel."""
    model = env_options(current=(0.1, 0.0, -0.1), wave={"amplitude": 0.05}).model
    assert model.effects["current"] == {"north": 0.1, "east": 0.0, "down": -0.1}
    assert model.effects["wave"]["amplitude"] == 0.05
    assert not env_options(current=(0.0, 0.0, 0.0)).model.declared


RESETS = [
    ({"sate": {}}, ConfigError, "'sate'.* are unknown; use state, goal, parameters"),
    ({"state": [1, 2]}, ConfigError, "'state' must be a mapping"),
    ({"goal": None}, ConfigError, "'goal' must be a mapping"),
    ({"state": {"velocity": [0, 0, 0]}}, ConfigError, "state 'velocity'"),
    ({"state": {"position": [0, 0]}}, ConfigError, "state 'position'"),
    ({"state": {"position": [0, 0, np.nan]}}, ConfigError, "finite numbers"),
    ({"state": {"position": [0, 0, "deep"]}}, ConfigError, "finite numbers"),
    ({"state": {"position": [0, 0, 3.0]}}, ConfigError, r"failed already \(bottom\)"),
    ({"state": {"euler": [2.0, 0, 0]}}, ConfigError, r"failed already \(tumbled\)"),
    ({"goal": {"deep": 0.5}}, ConfigError, "goal 'deep'"),
    ({"goal": {"depth": "a"}}, ConfigError, "goal 'depth'"),
    ({"goal": {"depth": 5.0}}, ConfigError, "may swim from 0.05 to 0.95 m"),
    ({"goal": {"cruise_speed": -1.0}}, ConfigError, "cruise_speed -1.0"),
    ({"parameters": {"mass.totl": 2.0}}, ParameterError, "did you mean 'mass.total'"),
    ({"parameters": {"mass.total": -1.0}}, ParameterError, "mass.total"),
    ({"parameters": {"mass.total": np.nan}}, ConfigError, "finite number"),
    ({"parameters": {"mass.total": [2.0]}}, ConfigError, "finite number"),
    (
        {"parameters": {"effects.current.north": 0.1}},
        EffectError,
        "switch the effect on when the environment is made",
    ),
]


@pytest.mark.parametrize(("options", "error", "message"), RESETS, ids=[str(r[0]) for r in RESETS])
def test_wrong_reset_options_are_refused_by_name(options, error, message):
    """The single and the vector environment refuse alike, before or as the episode would start."""
    for env in (RoboticFish3DEnv(), RoboticFish3DVectorEnv(2)):
        with pytest.raises(error, match=message):
            env.reset(seed=0, options=options)


def test_an_effect_faster_than_a_physics_step_divides_it():
    """An extended model loads whatever its lag; delays and control steps stay as they are."""
    env = RoboticFish3DEnv(
        effects={"servo_lag": {"time_constant": 0.004}}, observation_delay_s=0.02
    )
    env.reset(seed=0)
    for _ in range(5):
        assert np.isfinite(env.step(env.action_space.sample())[0]).all()
    options = env_options(effects={"servo_lag": {"time_constant": 0.004}})
    assert options.config.dt <= 0.004
    assert options.config.control_period == pytest.approx(env_options().config.control_period)


def test_effect_parameters_given_to_reset_are_checked():
    """Bounds and the longest physics step hold for an episode as they do for the constructor."""
    env = RoboticFish3DEnv(effects={"servo_lag": {"time_constant": 0.1}})
    for value, message in ((0.002, "use dt <= 0.002"), (5.0, "between 0.0 and 1.0")):
        with pytest.raises(EffectError, match=message):
            env.reset(options={"parameters": {"effects.servo_lag.time_constant": value}})


def test_a_goal_does_not_depend_on_the_order_of_its_keys():
    """A constant replaces the drawn signal; fields named beside it are kept, in either order."""
    env = RoboticFish3DEnv("track")
    seen = []
    for keys in (("depth", "depth_step"), ("depth_step", "depth")):
        goal = {key: {"depth": 0.4, "depth_step": 0.1}[key] for key in keys}
        seen.append(env.reset(seed=3, options={"goal": goal})[1]["goal_depth"])
    assert seen == [0.5, 0.5]


def test_a_fish_may_be_a_name_a_path_or_parameters(tmp_path):
    """All three give the same motion."""
    path = tmp_path / "mine.yaml"
    path.write_text("base: zheng-2021-b\nname: mine\n")
    ends = []
    for fish in ("zheng-2021-b", path, load_fish("zheng-2021-b")):
        env = RoboticFish3DEnv(fish=fish)
        env.reset(seed=1)
        for _ in range(20):
            env.step(np.full(5, 0.5, np.float32))
        ends.append(env.state)
    assert ends[0] == ends[1] == ends[2]
