"""What names, message types and values of columns are taken for, and how that is said."""

from pathlib import Path

import numpy as np
import pytest

from fish_env.data.importing import Guess, Source, guess_mapping

TIME = np.arange(100) * 0.04


def guessed(columns: dict, frame: str | None = "ned", **about) -> Guess:
    values = {name: np.asarray(values, float) for name, values in columns.items()}
    source = Source(Path("swim.csv"), about.pop("part", ""), {"t": TIME, **values}, **about)
    return guess_mapping([source], "swim", "zheng-2021-a", frame)


@pytest.mark.parametrize(
    ("column", "channel"),
    [
        ("Pos X [mm]", "x"),
        ("pose.pose.position.x", "x"),
        ("fish_x", "x"),
        ("position(:,1)", None),
        ("Northing", "x"),
        ("waterDepth_cm", "depth"),
        ("Heading (deg)", "yaw"),
        ("psi", "yaw"),
        ("rollRate", "p"),
        ("x (Meter)", "x"),
        ("Xpos", "x"),
        ("Yaw Rate (Degrees/s)", "r"),
        ("Yaw angle in degrees", "yaw"),
        ("Tiefe [cm]", "depth"),
        ("Nickwinkel [°]", "pitch"),
        ("Gierrate [°/s]", "r"),
        ("gyro_z", "r"),
        ("surge velocity", "u"),
        ("tail_servo_position", "tail_angle"),
        ("position[tail_joint]", "tail_angle"),
        ("position[left_fin]", None),
        ("linear_acceleration.x", None),
        ("desired_yaw", None),
        ("yaw_ref", None),
        ("battery", None),
        ("camera_frequency", None),
        ("x_error", None),
    ],
)
def test_a_channel_is_known_by_its_name(column, channel):
    content = guessed({column: np.sin(TIME)}).content
    assert list(content["channels"]) == ([channel] if channel else [])


@pytest.mark.parametrize(
    ("part", "column", "command"),
    [
        ("", "Tail Offset (deg)", "tail_offset"),
        ("", "cmd_amplitude", "tail_amplitude"),
        ("", "tailbeat frequency", "tail_frequency"),
        ("", "freq_setpoint_hz", "tail_frequency"),
        ("", "slider_pos_mm", "block_displacement"),
        ("", "bias angle", "tail_offset"),
        ("", "Schwanz Versatz [Grad]", "tail_offset"),
        ("", "Schlagfrequenz [Hz]", "tail_frequency"),
        ("", "mean", None),
        ("/servo/tail_bias/command", "data", "tail_offset"),
        ("", "x_offset", None),
    ],
)
def test_a_command_is_known_by_its_name(part, column, command):
    content = guessed({column: 0.1 + 0 * TIME}, part=part).content
    assert list(content["commands"]) == ([command] if command else [])


@pytest.mark.parametrize(
    ("columns", "unit"),
    [
        ({"yaw": 1.5 * np.sin(TIME)}, "rad"),
        ({"yaw": 80 * np.sin(TIME)}, "deg"),
        ({"roll": 2 * np.sin(30 * TIME)}, "deg"),
        ({"x": 0.1 * TIME}, "m"),
        ({"x": 100 * TIME}, "mm"),
        ({"r": 20 * np.sin(TIME)}, "deg/s"),
        ({"r": 0.2 * np.sin(TIME)}, "rad/s"),
        ({"tail_amplitude": 20 + 0 * TIME}, "deg"),
        ({"tail_amplitude": 0.3 + 0 * TIME}, "rad"),
        ({"u": 90 + 0 * TIME}, "mm/s"),
        ({"x_mm": 0.1 * TIME}, "mm"),
        ({"yaw [grad]": 80 * np.sin(TIME)}, "deg"),
    ],
)
def test_a_unit_is_what_the_name_says_or_the_values_allow(columns, unit):
    guess = guessed(columns)
    (entry,) = {**guess.content["channels"], **guess.content["commands"]}.values()
    assert entry["unit"] == unit
    stated = "_mm" in next(iter(columns))
    assert ("assumed (" in " ".join(guess.assumptions)) != stated


def test_a_rate_is_in_degrees_if_the_angles_are():
    guess = guessed({"yaw_deg": 20 * np.sin(TIME), "r": 0.2 * np.sin(TIME)})
    assert guess.content["channels"]["r"]["unit"] == "deg/s"


def test_theta_is_the_yaw_of_a_pose_in_the_plane():
    guess = guessed({"x": TIME, "y": TIME, "theta": np.sin(TIME)})
    assert list(guess.content["channels"]) == ["x", "y", "yaw"]
    assert "yaw: 'theta', as the table has x, y and no other angle" in guess.assumptions
    for more in ("phi", "psi", "z"):
        content = guessed({"x": TIME, "y": TIME, more: TIME, "theta": np.sin(TIME)}).content
        assert "pitch" in content["channels"], more


def test_names_tell_of_frames():
    up = guessed({"x": TIME, "altitude": -TIME}, frame=None).content
    assert up["frame"] == "enu"
    assert "frame" not in up["channels"]["z"]
    down = guessed({"x": TIME, "altitude": -TIME}, frame="ned").content
    assert down["channels"]["z"]["sign"] == -1
    assert guessed({"north": TIME, "east": TIME}, frame=None).content["frame"] == "ned"
    compass = guessed({"x": TIME, "heading": TIME}, frame="enu").content
    assert compass["channels"]["yaw"]["frame"] == "ned"
    assert "frame" not in guessed({"x": TIME, "y": TIME}, frame=None).content


def test_velocities_along_axes_of_the_tank_are_no_body_velocities():
    columns = {f"twist.{kind}.{axis}": TIME for kind in ("linear", "angular") for axis in "xyz"}
    about = {"part": "/vicon/twist", "kind": "geometry_msgs/msg/TwistStamped"}
    columns |= {"recorded": TIME, "header.stamp": TIME}
    body = guessed(columns, frame_id="base_link", **about)
    assert list(body.content["channels"]) == ["u", "v", "w", "p", "q", "r"]
    world = guessed(columns, frame_id="map", **about)
    assert list(world.content["channels"]) == []
    assert "twist.linear.x" in world.left_out[0]
