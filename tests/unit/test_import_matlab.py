"""MATLAB files of version 5, and of 7.3 as MATLAB lays them out."""

from pathlib import Path

import numpy as np
import pytest

from fish_env.data import load_dataset
from fish_env.data.importing import open_logs
from tests.command_line import run
from tests.fixtures.foreign_logs import Swim, swim


@pytest.fixture(scope="module")
def motion() -> Swim:
    return swim()


def matlab_tree(motion: Swim) -> dict[str, dict[str, np.ndarray]]:
    """Two structs, as Simulink's logging makes them, the servo on a clock of its own."""
    c = motion.channels
    return {
        "pose": {
            "time": motion.time_s,
            "position": np.column_stack([c["x"], c["y"], c["z"] + 0.4]),
            "yaw_deg": np.degrees(c["yaw"]),
            "yaw_rate": c["r"],
        },
        "servo": {
            "time": motion.command_times_s,
            "tail_offset": motion.commands[:, 0],
            "tail_amplitude": motion.commands[:, 1],
            "tail_frequency": motion.commands[:, 2],
        },
    }


MATLAB = """\
format: robofish-import/1
name: pool
fish: zheng-2021-a
frame: ned
sources:
  pose: {part: pose, time: {column: time, unit: s}}
  servo: {part: servo, time: {column: time, unit: s}}
channels:
  x: {source: pose, column: "position(:,1)", unit: m}
  y: {source: pose, column: "position(:,2)", unit: m}
  z: {source: pose, column: "position(:,3)", unit: m}
  yaw: {source: pose, column: yaw_deg, unit: degrees}
  r: {source: pose, column: yaw_rate, unit: rad/s}
commands:
  tail_offset: {source: servo, column: tail_offset, unit: rad}
  tail_amplitude: {source: servo, column: tail_amplitude, unit: rad}
  tail_frequency: {source: servo, column: tail_frequency, unit: hz}
constant_commands: {block_displacement: 0, block_angle: 0}
"""


def write_hdf5(file: Path, tree: dict[str, dict[str, np.ndarray]]) -> None:
    """A file of version 7.3 as MATLAB lays it out: user block, classes, columns first."""
    import h5py

    with h5py.File(file, "w", userblock_size=512) as target:
        for name, struct in tree.items():
            group = target.create_group(name)
            group.attrs["MATLAB_class"] = np.bytes_("struct")
            for field, values in struct.items():
                dataset = group.create_dataset(field, data=np.atleast_2d(values.T))
                dataset.attrs["MATLAB_class"] = np.bytes_("double")
        text = target.create_dataset("note", data=np.array([[72], [105]], np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        target["away"] = h5py.ExternalLink("/etc/passwd", "/")
        cells = target.create_dataset("cells", (2, 1), dtype=h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
    with file.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" "))


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab(tmp_path, capsys, motion, version):
    from scipy.io import savemat

    file, mapping = tmp_path / "swim.mat", tmp_path / "mapping.yaml"
    tree = matlab_tree(motion)
    if version == "5":
        savemat(file, {**tree, "note": "Hi", "gain": 3.0, "cells": np.array([1, "a"], object)})
    else:
        write_hdf5(file, tree)
    mapping.write_text(MATLAB)
    out = tmp_path / "out"
    status, shown, err = run(
        capsys, "import", str(file), "--out", str(out), "--mapping", str(mapping)
    )
    assert not err
    assert status == 0
    assert "cells left out" in shown
    assert ("away left out: it is a link" in shown) == (version == "7.3")
    measured = load_dataset(out).runs[0]
    present = np.isfinite(measured.channels["x"])
    for name, truth in (motion.channels | {"z": motion.channels["z"] + 0.4}).items():
        if name in measured.channels:
            np.testing.assert_allclose(measured.channels[name][present], truth, atol=1e-12)
    np.testing.assert_allclose(measured.commands.values, motion.commands, atol=1e-12)
    np.testing.assert_allclose(measured.commands.times_s, motion.command_times_s, atol=1e-9)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_a_struct_array_is_a_run_each(tmp_path, version):
    import h5py
    from scipy.io import savemat

    file = tmp_path / "swim.mat"
    runs = [{"t": np.arange(4.0), "x": 0.1 * i + np.arange(4.0)} for i in range(2)]
    if version == "5":
        savemat(file, {"trial": np.array(runs, dtype=object)})
    else:
        with h5py.File(file, "w") as target:
            group = target.create_group("trial")
            for field in ("t", "x"):
                refs = group.create_dataset(field, (2, 1), dtype=h5py.ref_dtype)
                for i, one in enumerate(runs):
                    stored = target.create_dataset(f"#refs#/{field}{i}", data=one[field][None])
                    refs[i, 0] = stored.ref
    sources, _ = open_logs([file])
    assert [source.part for source in sources] == ["trial(1)", "trial(2)"]
    np.testing.assert_array_equal(sources[1].numbers("x"), runs[1]["x"])
