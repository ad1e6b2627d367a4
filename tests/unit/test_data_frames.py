"""The conversion from `enu`, against rotation matrices and a fish drawn by hand."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fish_env.data import CommandSteps, Dataset, Run, load_dataset, write_dataset
from fish_env.data.frames import switch_dataset_frame, switch_frame, switch_tail_phase
from fish_env.data.vocabulary import CHANNELS
from tests.fixtures.measured_data import DESCRIPTION, good_folder, steady_folder

NED_FROM_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
BODY_FLIP = np.diag([1.0, -1.0, -1.0])


def random_dataset(seed: int = 0) -> Dataset:
    rng = np.random.default_rng(seed)
    channels = {name: rng.uniform(-1.2, 1.2, 50) for name in CHANNELS}
    commands = CommandSteps(
        np.array([0.0, 2.0]), np.array([[0.3, 0.2, 1.0, 0.01, 0.4], [0.0, 0.2, 1.0, 0.01, -0.4]])
    )
    run = Run("r01", np.arange(50.0), channels, commands, "rest", 0.3)
    return Dataset("d", "zheng-2021-a", (run,), {"x": 0.1, "y": 0.2, "yaw": 0.3})


def test_positions_attitudes_and_rates_follow_the_axes():
    enu = random_dataset().runs[0].channels
    ned = switch_frame(enu)

    def vectors(channels, names):
        return np.column_stack([channels[name] for name in names])

    def attitude(channels):
        return Rotation.from_euler("ZYX", vectors(channels, ["yaw", "pitch", "roll"])).as_matrix()

    np.testing.assert_allclose(vectors(ned, "xyz"), vectors(enu, "xyz") @ NED_FROM_ENU.T)
    np.testing.assert_allclose(vectors(ned, "uvw"), vectors(enu, "uvw") @ BODY_FLIP)
    np.testing.assert_allclose(vectors(ned, "pqr"), vectors(enu, "pqr") @ BODY_FLIP)
    expected = NED_FROM_ENU @ attitude(enu) @ BODY_FLIP
    np.testing.assert_allclose(attitude(ned), expected, atol=1e-12)


def test_tail_and_block_point_the_same_way_in_space():
    enu = random_dataset().runs[0]
    ned = switch_dataset_frame(random_dataset()).runs[0]
    time = 0.7

    def tail(run):
        offset, amplitude, frequency = run.commands.values[0, :3]
        angle = offset + amplitude * math.sin(2 * math.pi * frequency * time + run.tail_phase)
        return np.array([-math.cos(angle), -math.sin(angle), 0.0])

    def block(run, down):
        # The bracket turns from the z axis towards the y axis; the block hangs below it.
        angle = run.commands.values[0, 4]
        return down * np.array([0.0, math.sin(angle), math.cos(angle)])

    np.testing.assert_allclose(tail(ned), BODY_FLIP @ tail(enu), atol=1e-12)
    np.testing.assert_allclose(block(ned, 1.0), BODY_FLIP @ block(enu, -1.0), atol=1e-12)


def test_a_fish_drawn_by_hand(tmp_path):
    # It lies 2 m east, 1 m north, 0.3 m under the surface, heads north-east by 30 degrees from
    # east, nose 10 degrees up, swims ahead, slips to port and turns to port; its tail is held 20
    # degrees to starboard (a turn to port about the z axis, seen from above, of the tail's root).
    run = (
        "t,x,y,z,depth,yaw,pitch,u,v,r,tail_offset\n"
        "0,2,1,-0.3,0.3,30,-10,0.2,0.05,5,20\n"
        "1,2,1,-0.3,0.3,30,-10,0.2,0.05,5,20\n"
    )
    folder = good_folder(
        tmp_path,
        run,
        frame="enu",
        channels={"x": "m", "y": "m", "z": "m", "depth": "m", "yaw": "deg", "pitch": "deg"}
        | {"u": "m/s", "v": "m/s", "r": "deg/s"},
        commands={"tail_offset": "deg"},
        constant_commands={n: 0.0 for n in DESCRIPTION["commands"] if n != "tail_offset"},
        noise={"x": 0.1, "y": 0.2},
    )
    dataset = load_dataset(folder)
    channels = {name: float(values[0]) for name, values in dataset.runs[0].channels.items()}
    expected = {
        "x": 1.0,  # north
        "y": 2.0,  # east
        "z": 0.3,  # down
        "pitch": math.radians(10.0),  # nose up is positive with starboard as the y axis
        "yaw": math.radians(60.0),  # from north towards east
        "u": 0.2,
        "v": -0.05,  # to port
        "r": math.radians(-5.0),  # to port
    }
    assert channels == pytest.approx(expected)
    assert dataset.runs[0].commands.values[0, 0] == pytest.approx(math.radians(-20.0))
    assert dataset.noise == {"x": 0.2, "y": 0.1}
    assert any("enu" in note for note in dataset.notes)


def test_quaternions_in_enu(tmp_path):
    enu = {"yaw": 0.4, "pitch": -0.2, "roll": 0.3}
    x, y, z, w = Rotation.from_euler("ZYX", list(enu.values())).as_quat()
    row = f"{w!r},{x!r},{y!r},{z!r}".replace("np.float64(", "").replace(")", "")
    folder = good_folder(
        tmp_path,
        f"t,qw,qx,qy,qz\n0,{row}\n1,{row}\n",
        frame="enu",
        channels=dict.fromkeys(("qw", "qx", "qy", "qz"), "1"),
        commands={},
        constant_commands=dict.fromkeys(DESCRIPTION["commands"], 0.0),
    )
    channels = {name: a[0] for name, a in load_dataset(folder).runs[0].channels.items()}
    expected = {"roll": 0.3, "pitch": 0.2, "yaw": math.pi / 2 - 0.4}
    assert channels == pytest.approx(expected)


def test_round_trip_through_enu_files(tmp_path):
    dataset = random_dataset()
    back = load_dataset(write_dataset(dataset, tmp_path / "enu", frame="enu"))
    assert "frame: enu" in (tmp_path / "enu" / "dataset.yaml").read_text()
    for name, values in dataset.runs[0].channels.items():
        np.testing.assert_allclose(back.runs[0].channels[name], values, atol=1e-15)
    assert back.runs[0].commands == dataset.runs[0].commands
    assert back.runs[0].tail_phase == pytest.approx(dataset.runs[0].tail_phase)
    assert back.noise == dataset.noise


@pytest.mark.parametrize("phase", [None, 0.0, 1.0, -1.0, math.pi])
def test_tail_phase_switches_back(phase):
    there = switch_tail_phase(phase)
    assert switch_tail_phase(there) == (None if phase is None else pytest.approx(phase))
    assert there is None or math.sin(there) == pytest.approx(-math.sin(phase))


def test_steady_tables_change_sign_too(tmp_path):
    ned, enu = (
        load_dataset(steady_folder(tmp_path / frame, frame=frame)) for frame in ("ned", "enu")
    )
    assert enu.notes
    np.testing.assert_array_equal(enu.observations["yaw_rate"], -ned.observations["yaw_rate"])
    np.testing.assert_array_equal(enu.observations["surge_speed"], ned.observations["surge_speed"])
    np.testing.assert_array_equal(enu.commands[:, 0], -ned.commands[:, 0])
    np.testing.assert_array_equal(enu.commands[:, 1:], ned.commands[:, 1:])
