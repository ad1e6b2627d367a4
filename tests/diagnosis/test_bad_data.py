"""Bad data end in a clear error with status 2, or in a verdict that claims nothing unknown."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

from fish_env.data import COMMANDS, load_dataset
from fish_env.diagnosis import diagnose
from fish_env.diagnosis.input_checks import check_runs, doubts
from fish_env.params import load_fish, save_fish
from tests.command_line import run
from tests.diagnosis.pool import Pool, pool

Spoil = Callable[[Pool], None]


def robofish(capsys, *arguments: str) -> tuple[int, str]:
    """Exit status of the command and what it wrote to standard error."""
    status, _, error = run(capsys, *arguments)
    return status, error


def cell(row: int, column: str, text: str) -> Spoil:
    """One cell of the first run, rows counted from 1, the header."""

    def spoil(data: Pool) -> None:
        lines = [",".join(data.runs["r1"])]
        table = zip(*(values.tolist() for values in data.runs["r1"].values()), strict=True)
        lines += [",".join(map(repr, values)) for values in table]
        cells = lines[row - 1].split(",")
        cells[list(data.runs["r1"]).index(column)] = text
        lines[row - 1] = ",".join(cells)
        data.raw["r1.csv"] = "\n".join(lines) + "\n"

    return spoil


def scaled(factor: float, *names: str, unit: str | None = None) -> Spoil:
    """Columns of every run times a factor, with another unit declared if wanted."""

    def spoil(data: Pool) -> None:
        data.each(lambda c: c | {name: factor * c[name] for name in names})
        for name in names if unit else ():
            data.description["channels"][name] = unit

    return spoil


def described(**changes: object) -> Spoil:
    return lambda data: data.description.update(changes)


def declared(section: str, **changes: str) -> Spoil:
    return lambda data: data.description[section].update(changes)


def only(*names: str) -> Spoil:
    """The camera's channels, or any others."""

    def spoil(data: Pool) -> None:
        data.description["channels"] = {n: data.description["channels"][n] for n in names}

    return spoil


def both(*spoils: Spoil) -> Spoil:
    def spoil(data: Pool) -> None:
        for one in spoils:
            one(data)

    return spoil


def emptied(data: Pool) -> None:
    data.runs["r2"]["yaw"][:] = np.nan


def unsorted(data: Pool) -> None:
    t = data.runs["r2"]["t"]
    t[100:] -= 3.0


def set_back(data: Pool) -> None:
    data.runs["r2"]["t"][100:] -= 4.0


def missing_file(data: Pool) -> None:
    data.entry("r3")["file"] = "r4.csv"


def no_number(data: Pool) -> None:
    cell(5, "x", "near")(data)


def quaternion(data: Pool, scalar_last: bool = True) -> None:
    """The attitude as a quaternion, its four columns named in the wrong order."""

    def change(c):
        r, p, y = (0.5 * c[name] for name in ("roll", "pitch", "yaw"))
        y = y + (0.8 if scalar_last else 0.0)
        cr, sr, cp, sp, cy, sy = (f(a) for a in (r, p, y) for f in (np.cos, np.sin))
        four = [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]  # fmt: skip
        four = four[1:] + four[:1] if scalar_last else four
        kept = {k: v for k, v in c.items() if k not in ("roll", "pitch", "yaw")}
        return kept | dict(zip(("qw", "qx", "qy", "qz"), four, strict=True))

    data.each(change)
    kept = {k: v for k, v in data.description["channels"].items()
            if k not in ("roll", "pitch", "yaw")}  # fmt: skip
    data.description["channels"] = kept | dict.fromkeys(("qw", "qx", "qy", "qz"), "1")


def height_as_depth(data: Pool) -> None:
    data.each(lambda c: {("depth" if k == "z" else k): (-v if k == "z" else v)
                         for k, v in c.items()} | {"depth": -c["z"] - 0.5})  # fmt: skip
    channels = data.description["channels"]
    channels["depth"] = channels.pop("z")


UNREADABLE: dict[str, tuple[Spoil, list[str]]] = {
    "unknown unit": (declared("channels", x="parsnip"), ["channels.x", "unknown unit 'parsnip'"]),
    "unknown channel": (declared("channels", heading="rad"), ["unknown channel 'heading'"]),
    "unknown column": (declared("channels", u="m/s"), ["r1.csv", "column u", "not in the file"]),
    "time not increasing": (cell(6, "t", "0.04"), ["run r1", "row 6", "does not increase"]),
    "clock set back": (set_back, ["run r2", "row 102", "set back"]),
    "no sample at all": (emptied, ["run r2", "column yaw", "no row has a value"]),
    "cells": (cell(4, "x", "1,2"), ["run r1", "row 4", "16 cells"]),
    "no number": (no_number, ["run r1", "row 5", "'near'"]),
    "degrees as radians": (scaled(57.3, "yaw"), ["column yaw", "can only be degrees"]),
    "rates in degrees": (scaled(573.0, "r"), ["column r", "can only be degrees"]),
    "angle out of range": (cell(7, "pitch", "1.7"), ["row 7", "column pitch", "outside"]),
    "offset in degrees": (scaled(57.3, "tail_offset"), ["column tail_offset", "degrees"]),
    "block in mm": (scaled(1e3, "block_displacement"), ["column block_displacement", "'m'"]),
    "mm as m": (scaled(1e3, "x", "y", "z"), ["run r1", "column", "smaller unit than 'm'"]),
    "m as mm": (
        declared("channels", x="mm", y="mm", z="mm"), ["run r1", "the unit 'm' instead of 'mm'"]
    ),
    "scalar last": (quaternion, ["qw,qx,qy,qz", "scalar"]),
    "missing file": (missing_file, ["r4.csv", "run r3", "no such file"]),
    "file twice": (
        lambda data: data.entry("r2").update(file="./r1.csv"), ["two runs have the file"]
    ),
    "frame": (described(frame="nwu"), ["frame", "ned, enu"]),
    "fish": (described(fish="zheng-2020"), ["key fish", "'zheng-2020'"]),
    "format": (described(format="runs/2"), ["format"]),
    "depth in the air": (height_as_depth, ["column depth", "outside -0.5"]),
}  # fmt: skip


def zeros(data: Pool) -> None:
    data.runs["r2"]["x"][80:120] = 0.0


def stuck(data: Pool) -> None:
    data.runs["r3"]["q"][60:90] = data.runs["r3"]["q"][60]


def constant(data: Pool) -> None:
    data.runs["r1"]["pitch"][:] = 0.1


def short(data: Pool) -> None:
    data.add("r4", {name: values[:8] for name, values in data.runs["r1"].items()})
    data.runs["r4"]["x"] += 1e-4


def renamed(data: Pool) -> None:
    data.add("r4", data.runs["r1"])


def shifted(data: Pool) -> None:
    data.add("r4", data.runs["r1"] | {"t": data.runs["r1"]["t"] + 31.7})


def cut(data: Pool) -> None:
    data.add("r4", {name: values[50:150] for name, values in data.runs["r1"].items()})


def forward(jump: float) -> Spoil:
    def spoil(data: Pool) -> None:
        data.runs["r2"]["t"][100:] += jump

    return spoil


MISLEADING: dict[str, tuple[Spoil, list[str]]] = {
    "zeros": (zeros, ["run r2", "x is stuck at 0 for 40 samples in a row", "t = 3.2 s"]),
    "stuck": (stuck, ["run r3", "q is", "30 samples in a row"]),
    "constant": (constant, ["run r1", "pitch is 0.1 in every sample"]),
    "short": (short, ["run r4", "less than one tail beat", "`time` a larger unit"]),
    "renamed": (renamed, ["runs r1 and r4 have the same samples"]),
    "shifted": (shifted, ["runs r1 and r4 have the same samples"]),
    "cut": (cut, ["runs r1 and r4 have the same samples"]),
    "clock jumps far": (forward(60.0), ["run r2", "the clock jumps by 60.04 s"]),
    "clock jumps": (forward(1.0), ["run r2", "jumps by 1.04 s", "as if no time had passed"]),
    "tail only": (
        lambda data: (data.each(lambda c: c | {"tail_angle": 0.3 * np.sin(9.0 * c["t"])}),
                      data.description.update(channels={"tail_angle": "rad"})),
        ["measures only tail_angle"],
    ),
}  # fmt: skip


def refusal(capsys, data: Pool, tmp_path, command: str) -> str:
    folder, out = data.write(tmp_path / "data"), tmp_path / "out"
    more = (
        ["--out", str(out), "--quick"] if command == "diagnose" else ["--out", str(out / "f.yaml")]
    )
    status, err = robofish(capsys, command, str(folder), *more)
    assert status == 2
    assert err.startswith("robofish: ")
    assert "Traceback" not in err
    assert not out.exists()
    return " ".join(err.split())


@pytest.mark.parametrize("command", ["diagnose", "fit"])
@pytest.mark.parametrize("name", sorted(UNREADABLE))
def test_what_a_file_cannot_mean_is_refused(name, command, tmp_path, capsys):
    spoil, expected = UNREADABLE[name]
    data = pool()
    spoil(data)
    message = refusal(capsys, data, tmp_path, command)
    assert all(words in message for words in expected), message
    assert len(message) < 600


@pytest.mark.parametrize("name", sorted(MISLEADING))
def test_what_would_mislead_a_diagnosis_is_refused(name, tmp_path, capsys):
    spoil, expected = MISLEADING[name]
    data = pool()
    spoil(data)
    message = refusal(capsys, data, tmp_path, "diagnose")
    assert all(words in message for words in expected), message
    assert len(message) < 600


def test_a_good_dataset_is_not_refused(tmp_path):
    check_runs(load_dataset(pool().write(tmp_path / "good")))


def right_quaternion(data: Pool) -> None:
    quaternion(data, scalar_last=False)


def dropped(share: float, whole: bool) -> Spoil:
    """Samples lost at random: rows that are not there, or empty cells of each channel."""

    def spoil(data: Pool) -> None:
        rng = np.random.default_rng(1)
        for id, columns in data.runs.items():
            lost = rng.random(len(columns["t"])) < share
            lost[[0, -1]] = False
            if whole:
                # A row in which a command changes takes the command with it.
                lost &= ~np.any([np.diff(columns[c], prepend=columns[c][0]) for c in COMMANDS], 0)
                data.runs[id] = {name: values[~lost] for name, values in columns.items()}
                continue
            for name in data.description["channels"]:
                empty = rng.random(len(columns["t"])) < share
                columns[name][empty] = np.nan

    return spoil


def gap(data: Pool) -> None:
    for name in data.description["channels"]:
        data.runs["r2"][name][90:120] = np.nan


def coarse(data: Pool) -> None:
    data.each(lambda c: c | {n: np.round(c[n], 3) for n in ("x", "y", "z")})


POOR: dict[str, Spoil] = {
    "quaternion": right_quaternion,
    "empty cells": dropped(0.3, whole=False),
    "lost rows": dropped(0.3, whole=True),
    "gap": gap,
    "coarse digits": coarse,
    "camera": only("x", "y", "z", "yaw"),
}


@pytest.mark.parametrize("name", sorted(POOR))
def test_merely_poor_data_are_not_refused(name, tmp_path):
    data = pool()
    POOR[name](data)
    check_runs(load_dataset(data.write(tmp_path / "data")))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["empty cells", "lost rows"])
def test_poor_data_of_a_sound_model_name_no_cause(name, tmp_path, capsys):
    data = pool()
    POOR[name](data)
    folder, out = data.write(tmp_path / "data"), tmp_path / "out"
    status, _ = robofish(capsys, "diagnose", str(folder), "--out", str(out), "--quick")
    assert status == 0
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer["verdict"] in ("no_misfit", "not_excited")
    assert answer["causes"] == []


@pytest.mark.slow
def test_the_file_of_a_lighter_fish_raises_a_doubt(tmp_path):
    """A third of the mass is missing from the file, which an added mass explains as well."""
    factor = 0.66
    paths = ("mass.total", "mass.buoyancy", *(f"inertia.rest[{i}]" for i in range(3)))
    data = pool()
    data.description["fish"] = "other.yaml"
    folder = data.write(tmp_path / "data")
    fish = load_fish("zheng-2021-a")
    save_fish(
        fish.replace({path: factor * fish.get(path) for path in paths}), folder / "other.yaml"
    )
    answer = diagnose(folder, quick=True)
    assert answer["verdict"] not in ("no_misfit", "not_excited")
    assert doubts(answer)


def answer_of(off=(), surge=(0.1, 0.3), sway=(1.0, 1.4)):
    masses = {"surge": surge, "sway": sway, "heave": (0.2, 1.2)}
    parameters = {axis: {"ci95": list(interval)} for axis, interval in masses.items()}
    return {
        "causes": [{"name": "added_mass", "parameters": parameters}],
        "parameters": [
            {"name": f"parameter:c{i}", "prior_sds_off": value} for i, value in enumerate(off)
        ],
    }


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (answer_of(), []),
        (answer_of([0.5, -1.0, 4.0]), []),
        (answer_of([0.5, -7.0]), ["c1 by 7"]),
        (answer_of(surge=(0.5, 0.8), sway=(0.6, 0.9)), ["0.6 to 0.8 kg"]),
        (answer_of(surge=(-0.2, 0.2), sway=(-0.2, 0.2)), []),
    ],
)
def test_doubts_are_voiced_when_they_should_be(answer, expected):
    said = doubts(answer)
    assert len(said) == len(expected)
    assert all(words in doubt for words, doubt in zip(expected, said, strict=True))
