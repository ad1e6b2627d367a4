"""`robofish simulate`: golden trajectories, its output, and refusals that name the key."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fish_env.commands.case import read_case
from fish_env.commands.simulate import COLUMNS, simulate_case
from fish_env.errors import ParameterError, RoboticFishError, ScheduleError
from fish_env.params import load_fish, save_fish

TOLERANCE = 1e-7
OWN = sorted((Path(__file__).parents[1] / "golden").glob("*.json"))
BESIDE = Path(__file__).resolve().parents[3] / "shared" / "spec" / "golden"
GIVEN = sorted(Path(os.environ.get("ROBOFISH_GOLDEN", BESIDE)).glob("*.json"))
CASE: dict[str, Any] = {
    "fish": "zheng-2021-a",
    "duration_s": 0.5,
    "schedule": [{"t": 0, "tail_amplitude": 0.35, "tail_frequency": 2.0}],
    "initial": None,
}


def written(folder: Path, **changes: Any) -> Path:
    file = folder / "case.json"
    file.write_text(json.dumps({**CASE, **changes}))
    return file


def simulated(case: Path, out: Path, dt: float = 0.001) -> pd.DataFrame:
    simulate_case(case, dt, 10.0, out)
    return pd.read_csv(out)


def golden_error(case: Path, out: Path) -> float:
    """Largest difference from the stored trajectory."""
    stored, here = pd.read_csv(case.with_suffix(".csv")), simulated(case, out)
    assert list(here.columns) == list(stored.columns) == list(COLUMNS)
    return float(np.abs(here.to_numpy() - stored.to_numpy()).max())


@pytest.mark.filterwarnings("ignore:.*beyond the crank's reach.*")
@pytest.mark.parametrize("case", [*OWN, *GIVEN], ids=lambda case: case.stem)
def test_golden(case: Path, tmp_path: Path) -> None:
    assert golden_error(case, tmp_path / "out.csv") < TOLERANCE


def test_golden_check_fails_on_another_motion(tmp_path: Path) -> None:
    case = json.loads(OWN[0].read_text())
    case["schedule"][0]["tail_amplitude"] *= 1.000001
    broken = tmp_path / OWN[0].name
    broken.write_text(json.dumps(case))
    broken.with_suffix(".csv").write_text(OWN[0].with_suffix(".csv").read_text())
    assert golden_error(broken, tmp_path / "out.csv") > TOLERANCE


def test_our_golden_set_is_there() -> None:
    assert len(OWN) >= 4


def test_prints_to_stdout_what_it_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = written(tmp_path)
    simulate_case(case, 0.01, 10.0, tmp_path / "out.csv")
    simulate_case(case, 0.01, 10.0, None)
    assert capsys.readouterr().out == (tmp_path / "out.csv").read_text()


def test_parquet_holds_the_same_numbers(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    case = written(tmp_path)
    simulate_case(case, 0.01, 10.0, tmp_path / "out.parquet")
    table = simulated(case, tmp_path / "out.csv", dt=0.01)
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "out.parquet"), table)


def test_quaternions_have_no_negative_scalar(tmp_path: Path) -> None:
    turned = {"euler_roll_pitch_yaw": [0.0, 0.0, 3.0], "angular_velocity_body": [0.0, 0.0, 3.0]}
    table = simulated(written(tmp_path, initial=turned), tmp_path / "out.csv")
    assert (table["qw"] >= 0.0).all()
    norms = np.linalg.norm(table[["qw", "qx", "qy", "qz"]], axis=1)
    np.testing.assert_allclose(norms, 1.0, atol=1e-12)


def test_starts_where_the_case_says(tmp_path: Path) -> None:
    initial = {"position_inertial": [1.0, -2.0, 0.5], "velocity_body": [0.1, 0.0, 0.0]}
    table = simulated(written(tmp_path, initial=initial), tmp_path / "out.csv")
    assert table.loc[0, ["x", "y", "z", "u"]].tolist() == [1.0, -2.0, 0.5, 0.1]


def test_effects_of_the_case_act(tmp_path: Path) -> None:
    flow = {"current": {"north": 0.3}}
    table = simulated(written(tmp_path, effects=flow, schedule=[{"t": 0}]), tmp_path / "out.csv")
    assert table["x"].iloc[-1] > 0.0


def test_a_fish_file_is_found_beside_the_case(tmp_path: Path) -> None:
    fish = load_fish("zheng-2021-a").replace({"mass.buoyancy": 2.0005})
    save_fish(fish, tmp_path / "mine.yaml")
    assert read_case(written(tmp_path, fish="mine.yaml")).fish == fish


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed": 1}, ["unknown key 'speed'"]),
        ({"durations": 1}, ["unknown key 'durations'", "'duration_s'"]),
        ({"duration_s": "5"}, ["duration_s", "finite number"]),
        ({"duration_s": True}, ["duration_s", "finite number"]),
        ({"duration_s": -1}, ["duration"]),
        ({"duration_s": 1e12}, ["lower the duration"]),
        ({"fish": 3}, ["fish", "preset"]),
        ({"schedule": {}}, ["schedule", "list of rows"]),
        ({"schedule": []}, ["schedule is empty"]),
        ({"schedule": [{"t": 0, "tail": 1}]}, ["unknown command", "tail"]),
        ({"schedule": [{"t": 0, "tail_offset": None}]}, ["schedule[0].tail_offset"]),
        ({"schedule": [{"t": 1}, {"t": 1}]}, ["increase"]),
        ({"schedule": [{"t": 1}] * 9999}, ["increase"]),
        ({"initial": {"euler": [0, 0, 0]}}, ["initial", "unknown key 'euler'"]),
        ({"initial": {"velocity_body": [0, 0]}}, ["initial.velocity_body", "three numbers"]),
        ({"initial": {"velocity_body": [0, 0, "a"]}}, ["initial.velocity_body[2]"]),
        ({"effects": {"current": 1}}, ["effects.current", "object"]),
    ],
)
def test_refusals_name_file_and_key(
    changes: dict[str, Any], words: list[str], tmp_path: Path
) -> None:
    case = written(tmp_path, **changes)
    with pytest.raises(ScheduleError) as caught:
        simulate_case(case, 0.01, 10.0, None)
    for word in [case.name, *words]:
        assert word in str(caught.value)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("key", ["fish", "duration_s", "schedule"])
def test_a_missing_key_is_named(key: str, tmp_path: Path) -> None:
    file = tmp_path / "case.json"
    file.write_text(json.dumps({name: value for name, value in CASE.items() if name != key}))
    with pytest.raises(ScheduleError, match=f"'{key}' is missing"):
        read_case(file)


@pytest.mark.parametrize("text", ["{", "[1]", '{"fish": "zheng-2021-a", "duration_s": NaN}'])
def test_text_that_is_no_case_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "case.json"
    file.write_text(text)
    with pytest.raises(ScheduleError, match=r"case\.json"):
        read_case(file)


def test_a_misspelt_preset_gets_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="zheng-2021-a"):
        read_case(written(tmp_path, fish="zheng-2021-aa"))


def test_a_missing_fish_file_is_looked_for_beside_the_case(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=f"{tmp_path}/no.yaml"):
        read_case(written(tmp_path, fish="no.yaml"))


def test_an_unknown_output_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScheduleError, match=r"\.csv or \.parquet"):
        simulate_case(written(tmp_path), 0.01, 10.0, tmp_path / "out.txt")


@pytest.mark.parametrize(
    "changes",
    [
        {"fish": "no-such"},
        {"effects": {"servo_lag": {"time_constant": -1.0}}},
        {"initial": {"velocity_body": [1e300, 0.0, 0.0]}},
    ],
    ids=["unknown fish", "an effect beyond its bounds", "a state that diverges"],
)
def test_a_case_that_cannot_be_simulated_is_named(changes: dict[str, Any], tmp_path: Path) -> None:
    case = written(tmp_path, **changes)
    with pytest.raises(RoboticFishError) as caught:
        simulated(case, tmp_path / "out.csv")
    assert str(caught.value).startswith(f"{case}: ")


def test_a_wrong_step_is_not_put_on_the_case(tmp_path: Path) -> None:
    with pytest.raises(ScheduleError, match=r"^dt = 1e-12"):
        simulated(written(tmp_path), tmp_path / "out.csv", dt=1e-12)
