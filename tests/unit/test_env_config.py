"""Settings of the environment: what can be changed, and what is refused and how."""

import numpy as np
import pytest
import yaml

from fish_env.envs.config import load_env_config
from fish_env.errors import ConfigError
from fish_env.model.state import INPUTS


def test_defaults_are_the_file():
    """What the file says is what the compiled step gets: rates, ranges, slew limits."""
    config = load_env_config()
    actuators = [config.tree["actuators"][name] for name in INPUTS]
    assert (config.dt, config.substeps, config.control_period) == (0.01, 10, pytest.approx(0.1))
    np.testing.assert_array_equal(config.low, [a["low"] for a in actuators])
    np.testing.assert_array_equal(config.high, [a["high"] for a in actuators])
    np.testing.assert_array_equal(config.slew, [a["slew"] for a in actuators])


def test_changes_are_merged_and_the_defaults_stay_clean():
    """A mapping states only what differs, and does not leak into the next environment."""
    changed = load_env_config({"tank": {"depth": 2.0}, "reward": {"margins": {"depth": 0.2}}})
    assert changed.tree["tank"] == {"depth": 2.0, "clearance": 0.05, "walls": None}
    assert changed.tree["reward"]["margins"]["heading"] == 0.20
    assert load_env_config().tree["tank"]["depth"] == 1.0


def test_a_file_does_what_a_mapping_does(tmp_path):
    """config= takes either."""
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump({"actuators": {"tail_frequency": {"high": 2.5, "slew": None}}}))
    config = load_env_config(path)
    assert config.high[2] == 2.5
    assert config.slew[2] == np.inf


@pytest.mark.parametrize(("control", "physics"), [(20.0, 100.0), (10.0, 200.0), (100.0, 100.0)])
def test_rates_set_the_physics_steps_of_a_control_step(control, physics):
    """control_hz and physics_hz win over the file."""
    config = load_env_config(None, control, physics)
    assert config.dt == pytest.approx(1 / physics)
    assert config.substeps == round(physics / control)


REFUSED = [
    ({"tanks": {}}, "unknown key 'tanks'"),
    ({"tank": {"deep": 1}}, "unknown key 'tank.deep'; known here: depth"),
    ({"tank": 3}, "'tank' must be a mapping"),
    ({"tank": {"depth": "deep"}}, "'tank.depth' must be a finite number, got 'deep'"),
    ({"tank": {"depth": True}}, "'tank.depth' must be a finite number"),
    ({"tank": {"depth": float("nan")}}, "'tank.depth' must be a finite number"),
    ({"tank": {"depth": None}}, "'tank.depth' must be a finite number"),
    ({"tank": {"clearance": 0.6}}, "twice the clearance exceeds depth"),
    ({"tank": {"walls": [1, 2, -1, 1]}}, "tank.walls: .north_min"),
    ({"tank": {"walls": 3}}, "tank.walls"),
    ({"goal": {"depth": 0.5}}, "'goal.depth' must have 2 numbers"),
    ({"goal": {"depth": [0.3, 1.2]}}, "goal.depth: a range"),
    ({"goal": {"cruise_speed": -0.1}}, "goal.cruise_speed -0.1: a speed >= 0"),
    ({"goal": {"cruise_speed": [0.1, 0.2, 0.3]}}, "goal.cruise_speed"),
    ({"goal": {"track": {"sine": {"period": [0, 0]}}}}, "goal.track.sine.period: positive"),
    ({"goal": {"track": {"step": {"time": [5, 1]}}}}, "goal.track.step.time"),
    ({"rates": {"control": 0}}, "0 < control <= physics"),
    ({"rates": {"control": 30}}, r"whole multiple of control \(30 Hz\); use 90 Hz"),
    ({"rates": {"control": 1, "physics": 1}}, "too slow"),
    ({"actuators": {"tail_offset": {"low": 1.0}}}, "actuators.tail_offset: low must be below"),
    ({"actuators": {"tail_offset": {"slew": 0}}}, "actuators.tail_offset.slew"),
    ({"actuators": {"tail_amplitude": {"low": -0.1}}}, "actuators.tail_amplitude.low"),
    ({"reward": {"margins": {"depth": 0}}}, "margins and power_scale must be positive"),
    ({"reward": {"weights": {"power": -1}}}, "reward.weights"),
    ({"success": {"time": -1}}, "success"),
    ({"tumble_angle": 9}, "tumble_angle"),
    ({"start": {"surge": [1, 0]}}, "start.surge"),
    ({"start": {"tilt": -1}}, "start.tilt"),
]


@pytest.mark.parametrize(("change", "message"), REFUSED, ids=[m for _, m in REFUSED])
def test_wrong_settings_are_refused_by_name(change, message):
    """Each error names the setting and says what it must be."""
    with pytest.raises(ConfigError, match=message):
        load_env_config(change)


@pytest.mark.parametrize("rate", [float("inf"), float("nan"), "fast", True, -10.0])
def test_rates_must_be_numbers(rate, tmp_path):
    """A rate that the constructor takes is not blamed on the file."""
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump({"rates": {"control": 10}}))
    for given, name in (((path, rate), "control_hz"), ((path, None, rate), "physics_hz")):
        with pytest.raises(ConfigError, match=f"^{name} "):
            load_env_config(*given)


@pytest.mark.parametrize(
    ("text", "message"), [("a: [", "not valid YAML"), ("", "must be a mapping like")]
)
def test_unreadable_files_are_named(text, message, tmp_path):
    """A broken or empty file is an error that names it."""
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=f"mine.yaml: {message}"):
        load_env_config(path)


def test_a_missing_file_and_a_wrong_type_are_named(tmp_path):
    """Neither becomes the defaults."""
    with pytest.raises(ConfigError, match="no such file"):
        load_env_config(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="give the path of a YAML file or a mapping"):
        load_env_config([1])
