"""Raw logs for `scripts.walks`: runs of a simulated robot, as other people's tools record them.

The robot is `zheng-2021-a` with a servo that lags by 0.04 s. The simulation does not know that.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import savemat

from fish_env import InitialState, Simulator, schedule
from tests.fixtures.foreign_logs import Swim, write_ros2

DURATION_S, RATE_HZ = 12.0, 25.0
NOISE = {
    "x": 0.002, "y": 0.002, "z": 0.003, "roll": 0.003, "pitch": 0.003, "yaw": 0.005,
    "p": 0.01, "q": 0.01, "r": 0.01,
}  # fmt: skip
"""Standard deviations: m, rad, rad/s."""
RUNS = {
    "straight": ((0.0, 0.0, 0.35, 2.0), (5.0, 0.0, 0.45, 1.2)),
    "port": ((0.0, 0.0, 0.35, 1.5), (4.0, 0.35, 0.40, 2.0)),
    "starboard": ((0.0, 0.0, 0.40, 2.4), (4.0, -0.35, 0.35, 1.2)),
    "weave": ((0.0, 0.2, 0.4, 1.8), (4.0, -0.3, 0.35, 2.2), (8.0, 0.1, 0.45, 1.4)),
}
"""Start (s), tail offset (rad), amplitude (rad) and frequency (Hz) of each command."""


def swims() -> dict[str, Swim]:
    """The runs with sensor noise, in SI units and the model's frame."""
    robot = Simulator("zheng-2021-a", effects={"servo_lag": {"time_constant": 0.04}})
    rng, found = np.random.default_rng(7), {}
    for name, plan in RUNS.items():
        rows = [
            {"t": t, "tail_offset": o, "tail_amplitude": a, "tail_frequency": f}
            for t, o, a, f in plan
        ]
        start = InitialState(position=(0.0, 0.0, 0.4))
        run = robot.run(rows, duration_s=DURATION_S, initial=start, rate_hz=RATE_HZ)
        time = np.array(run.time_s)
        channels = {
            n: np.array(run[n]) + s * rng.standard_normal(len(time)) for n, s in NOISE.items()
        }
        channels["tail_angle"] = np.zeros(len(time))  # not recorded
        asked = schedule(rows)
        found[name] = Swim(time, channels, asked.times_s, asked.values)
    return found


def write_csv(folder: Path) -> None:
    """Tables with decimal commas, in ms, mm and degrees: `pool-*.csv`."""
    for name, swim in swims().items():
        frame(swim).to_csv(folder / f"pool-{name}.csv", sep=";", decimal=",", index=False)


def write_bags(folder: Path) -> None:
    """ROS 2 bags with a pose in ENU, whose servo topic has the wrong sign: `bags/*`."""
    (folder / "bags").mkdir()
    for name, swim in swims().items():
        flipped = swim.commands * np.array([-1.0, 1.0, 1.0, 1.0, 1.0])
        motion = Swim(swim.time_s, swim.channels, swim.command_times_s, flipped)
        write_ros2(folder / "bags" / name, motion, "MCAP", imu_delay_s=0.0)


def write_mat(folder: Path) -> None:
    """MATLAB files with one struct `log`: `trial-*.mat`."""
    for name, swim in swims().items():
        table = frame(swim)
        log = {column: table[column].to_numpy()[:, None] for column in table}
        named = {
            "time": log["time_ms"] / 1000.0, "x_m": log["Pos X [mm]"] / 1000.0,
            "y_m": log["Pos Y [mm]"] / 1000.0, "depth_cm": log["Depth [cm]"],
            "roll_deg": log["Roll [deg]"], "pitch_deg": log["Pitch [deg]"],
            "yaw_deg": log["Heading [deg]"], "r_deg_s": log["Yaw rate [deg/s]"],
            "tail_offset_deg": log["cmd_offset_deg"],
            "tail_amplitude_deg": log["cmd_amplitude_deg"], "tail_frequency_hz": log["cmd_freq"],
        }  # fmt: skip
        savemat(folder / f"trial-{name}.mat", {"log": named})


def frame(swim: Swim) -> pd.DataFrame:
    """One run as a table of another tool: ms, mm, cm and degrees."""
    held = np.searchsorted(swim.command_times_s, swim.time_s + 1e-9, side="right") - 1
    asked, seen = swim.commands[held], swim.channels
    return pd.DataFrame(
        {
            "time_ms": np.round(1000 * swim.time_s, 3),
            "Pos X [mm]": np.round(1000 * seen["x"], 2),
            "Pos Y [mm]": np.round(1000 * seen["y"], 2),
            "Depth [cm]": np.round(100 * seen["z"], 3),
            "Roll [deg]": np.round(np.degrees(seen["roll"]), 3),
            "Pitch [deg]": np.round(np.degrees(seen["pitch"]), 3),
            "Heading [deg]": np.round(np.degrees(seen["yaw"]), 3),
            "Yaw rate [deg/s]": np.round(np.degrees(seen["r"]), 3),
            "cmd_offset_deg": np.round(np.degrees(asked[:, 0]), 4),
            "cmd_amplitude_deg": np.round(np.degrees(asked[:, 1]), 4),
            "cmd_freq": asked[:, 2],
        }
    )
