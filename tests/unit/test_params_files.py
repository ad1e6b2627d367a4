"""Finding, inheriting and writing fish files."""

import dataclasses
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fish_env.errors import ParameterError
from fish_env.params import Posterior, config_root, list_fish, load_fish, save_fish
from fish_env.params.files import read_yaml


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text)
    return file


@pytest.mark.parametrize("name", list_fish())
def test_a_saved_preset_loads_equal(tmp_path, name):
    fish = load_fish(name)
    save_fish(fish, tmp_path / "copy.yaml")
    again = load_fish(tmp_path / "copy.yaml")
    assert again == fish
    assert again.source_file == (tmp_path / "copy.yaml").resolve()


@settings(max_examples=25, deadline=None)
@given(factor=st.floats(0.9, 1.1), current=st.floats(-1, 1))
def test_a_round_trip_keeps_every_digit(tmp_path_factory, factor, current):
    fish = load_fish("zheng-2021-a")
    values = {path: fish.get(path) * factor for path in ("mass.total", "tail.area", "tail.drag.c0")}
    changed = dataclasses.replace(
        fish.replace(values, status="identified", source="drawn"),
        effects={"current": {"north": current}},
    )
    file = tmp_path_factory.mktemp("fish") / "copy.yaml"
    save_fish(changed, file)
    assert load_fish(file) == changed


def test_an_extended_model_keeps_its_effects_and_posterior(tmp_path):
    posterior = Posterior(
        names=("mass.total", "effects.servo_lag.time_constant"),
        mean=(2.0, np.float64(0.05)),
        covariance=((1e-4, 1e-7), (1e-7, 1e-5)),
        validity={"speed": [0.0, 0.3], "runs": ["r1", "r2"], "depth": np.array([0.1, 0.2])},
    )
    fish = dataclasses.replace(
        load_fish("zheng-2021-a"),
        effects={"servo_lag": {"time_constant": np.float64(0.05)}},
        posterior=posterior,
    )
    save_fish(fish, tmp_path / "extended.yaml")
    again = load_fish(tmp_path / "extended.yaml")
    assert again.effects == fish.effects
    assert again.posterior is not None
    assert again.posterior.covariance == posterior.covariance
    assert again.posterior.validity == {**posterior.validity, "depth": [0.1, 0.2]}
    save_fish(again, tmp_path / "again.yaml")
    assert load_fish(tmp_path / "again.yaml") == again


def test_a_saved_file_needs_no_base_and_names_no_folder(tmp_path):
    save_fish(load_fish("zheng-2021-b"), tmp_path / "copy.yaml")
    text = (tmp_path / "copy.yaml").read_text()
    assert "base" not in read_yaml(tmp_path / "copy.yaml")
    assert str(config_root()) not in text


def test_without_libyaml_files_read_the_same():
    """The parser in Python is there for a PyYAML that was built without the library."""
    program = (
        "import sys; sys.modules['yaml._yaml'] = None\n"
        "import yaml; assert not yaml.__with_libyaml__\n"
        "from fish_env.params import list_fish, load_fish\n"
        "print(*(repr(load_fish(name)) for name in list_fish()), sep='\\n')"
    )
    plain = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert plain.stdout.splitlines() == [repr(load_fish(name)) for name in list_fish()]


def test_save_refuses_another_ending(tmp_path):
    with pytest.raises(ParameterError, match=r"ending \.yaml"):
        save_fish(load_fish("zheng-2021-a"), tmp_path / "fish.json")


def test_fish_can_be_sent_to_another_process():
    fish = load_fish("zheng-2021-a")
    assert pickle.loads(pickle.dumps(fish)) == fish


def test_an_unknown_name_lists_the_presets():
    with pytest.raises(ParameterError) as caught:
        load_fish("zheng-2021-c")
    assert "did you mean 'zheng-2021-" in str(caught.value)
    assert "msu-tail-fish" in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"nowhere\.yaml: no such file"):
        load_fish(tmp_path / "nowhere.yaml")


def test_a_base_is_merged_key_by_key(tmp_path):
    file = write(
        tmp_path,
        "mine.yaml",
        "name: mine\nbase: zheng-2021-b\nbody: {plane_xy: {drag: {c0: 0.2}}, area: [1, 2, 3]}\n"
        "provenance: {body.area: {status: identified, source: weighed}}\n",
    )
    fish, base = load_fish(file), load_fish("zheng-2021-b")
    assert fish.name == "mine"
    assert fish.get("mass.buoyancy") == 2.001
    assert fish.get("body.plane_xy.drag.c2") == base.get("body.plane_xy.drag.c2")
    assert fish.get("body.plane_xy.drag.c0") == 0.2
    assert [fish.get(f"body.area[{axis}]") for axis in range(3)] == [1, 2, 3]
    assert fish.info("body.area[2]").status == "identified"
    assert fish.info("mass.total").source == base.info("mass.total").source


def test_a_base_may_be_a_file_beside_the_one_that_names_it(tmp_path):
    write(tmp_path, "first.yaml", "name: first\nbase: zheng-2021-a\nmass: {total: 2.1}\n")
    second = write(tmp_path, "second.yaml", "name: second\nbase: first.yaml\ntail: {area: 0.01}\n")
    assert load_fish(second).get("mass.total") == 2.1


def test_null_switches_off_the_effects_of_a_base(tmp_path):
    write(tmp_path, "wet.yaml", "name: wet\nbase: zheng-2021-a\neffects: {current: {north: 0.1}}\n")
    dry = write(tmp_path, "dry.yaml", "name: dry\nbase: wet.yaml\neffects:\n")
    assert load_fish(tmp_path / "wet.yaml").effects == {"current": {"north": 0.1}}
    assert load_fish(dry).effects == {}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("name: mine\nbase: mine.yaml\n", "form a circle"),
        ("name: mine\nbase: other.yaml\n", "form a circle"),
        ("name: mine\nbase: zheng\n", "no fish 'zheng'"),
        ("name: mine\nbase: 3\n", "base is 3"),
        ("base: zheng-2021-a\n", "missing key name"),
        ("name: mine\nbase: zheng-2021-a\nmass: {totl: 2}\n", "unknown key mass.totl"),
    ],
)
def test_a_wrong_base_fails(tmp_path, text, problem):
    write(tmp_path, "other.yaml", "name: other\nbase: mine.yaml\n")
    with pytest.raises(ParameterError) as caught:
        load_fish(write(tmp_path, "mine.yaml", text))
    assert "mine.yaml" in str(caught.value)
    assert problem in str(caught.value)


def test_a_file_without_provenance_says_so(tmp_path):
    data = read_yaml(config_root() / "fish" / "msu-tail-fish.yaml")
    text = (config_root() / "fish" / "msu-tail-fish.yaml").read_text().split("provenance:")[0]
    fish = load_fish(write(tmp_path, "bare.yaml", text))
    assert "provenance" in data
    assert fish.info("mass.total").source == "the parameter file names no source"
