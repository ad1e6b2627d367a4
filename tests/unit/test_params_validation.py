"""Every check of a parameter file fires, naming file, key and remedy."""

import copy
import warnings
from typing import Any

import numpy as np
import pytest
import yaml

from fish_env.errors import ParameterError
from fish_env.params import config_root, load_fish, save_fish
from fish_env.params.balance import central_inertia

PRESET = yaml.safe_load((config_root() / "fish" / "zheng-2021-a.yaml").read_text())
DELETE = object()


def changed(path: str, value: Any) -> dict[str, Any]:
    """The preset's data with one key set, or deleted."""
    data = copy.deepcopy(PRESET)
    *parents, last = [int(key) if key.isdigit() else key for key in path.split("/")]
    section = data
    for key in parents:
        section = section[key]
    if value is DELETE:
        del section[last]
    else:
        section[last] = value
    return data


def load_changed(tmp_path, data):
    file = tmp_path / "my-fish.yaml"
    file.write_text(yaml.safe_dump(data))
    return load_fish(file)


def test_the_unchanged_preset_loads(tmp_path):
    assert load_changed(tmp_path, PRESET) == load_fish("zheng-2021-a")


@pytest.mark.parametrize(
    ("path", "value", "key", "remedy"),
    [
        ("mass/totl", 2.0, "unknown key mass.totl", "did you mean 'total'?"),
        ("colour", "red", "unknown key colour", "known keys are name, water, mass"),
        ("body/plane_xy/drag/c1", 2.0, "unknown key body.plane_xy.drag.c1", "did you mean 'c"),
        ("mass/total", DELETE, "missing key mass.total", "add it"),
        ("prior", DELETE, "missing key prior", "add it"),
        ("prior/mass", DELETE, "missing key prior.mass", "add it"),
        ("name", DELETE, "missing key name", "add it"),
        ("name", 5, "name is 5", "give the fish a name"),
        ("mass/total", "heavy", "mass.total is 'heavy' (str)", "write a plain number"),
        ("mass/total", True, "mass.total is True (bool)", "write a plain number"),
        ("mass/total", None, "mass.total is None", "write a plain number"),
        ("mass/total", float("nan"), "mass.total is nan", "write a finite number"),
        ("mass/total", float("inf"), "mass.total is inf", "write a finite number"),
        ("body/area/0", True, "body.area[0] is True (bool)", "write a plain number"),
        ("mass", 2.0, "mass is 2.0", "write a section with the keys total"),
        ("body/area", 0.02, "body.area is 0.02", "write three numbers"),
        ("body/area", [0.1, 0.2], "body.area is [0.1, 0.2]", "write three numbers"),
        ("mass/total", 0.0, "mass.total", "give a value from 1e-06"),
        ("mass/buoyancy", 0, "mass.buoyancy", "give a value from 1e-06"),
        ("mass/weight_block", 0.0, "mass.weight_block", "give a value from 1e-06"),
        ("mass/weight_block", 2.0, "mass.weight_block", "give it a smaller mass"),
        ("inertia/rest/0", -0.001, "inertia.rest[0]", "give a value from"),
        ("inertia/rest/0", 0.0, "inertia.rest[0]", "give a value from"),
        ("inertia/weight_block/2", 0.0, "inertia.weight_block[2]", "give a value from"),
        ("inertia/rest", [0.001, 0.002, 0.005], "inertia.rest[2]", "check the three"),
        ("inertia/weight_block", [1, 0.1, 0.1], "inertia.weight_block[0]", "check the three"),
        ("mass/static_moment_rest", [0.3, 0.3, 0.3], "inertia is not", "static_moment_rest"),
        ("weight_block/crank/l1", 0.030, "weight_block.crank.l1", "l1 < l2"),
        ("weight_block/crank/l2", -0.1, "weight_block.crank.l2", "give a value from"),
        ("tail/area", -0.01, "tail.area", "give a value from"),
        ("body/area/1", -0.01, "body.area[1]", "give a value from"),
        ("tail/drag/c0", -0.01, "tail.drag.c0", "give a value from 0"),
        ("water/density", -1.0, "water.density", "give a value from 0"),
        ("body/rotational_damping/1", 0.02, "body.rotational_damping[1]", "to 0 N m s/rad"),
        ("prior/damping", -0.1, "prior.damping", "give a value from 0"),
        ("prior/damping", "wide", "prior.damping", "write a plain number"),
        ("effects", [1], "effects is [1]", "write effect names"),
        ("effects", {"current": 0.1}, "effects.current is 0.1", "with its parameters"),
        ("effects", {"current": {"north": "x"}}, "effects.current.north is 'x'", "plain number"),
        ("effects", {"current": {"north": True}}, "effects.current.north is True", "number"),
        ("provenance/default", DELETE, "missing key provenance.default", "status and source"),
        ("provenance/default/status", "guessed", "provenance.default.status", "use one of"),
        ("provenance/default/source", "", "provenance.default.source", "say in words"),
        ("provenance/default/origin", "x", "unknown key provenance.default.origin", "known keys"),
        (
            "provenance/mass.totl",
            {"status": "identified", "source": "x"},
            "provenance.mass.totl",
            "did you mean 'mass.total'?",
        ),
    ],
)
def test_a_wrong_file_fails_with_file_key_and_remedy(tmp_path, path, value, key, remedy):
    with pytest.raises(ParameterError) as caught:
        load_changed(tmp_path, changed(path, value))
    assert "my-fish.yaml" in str(caught.value)
    assert key in str(caught.value)
    assert remedy in str(caught.value)


POSTERIOR = {
    "names": ["mass.total", "effects.servo_lag.time_constant"],
    "mean": [2.0, 0.05],
    "covariance": [[1e-4, 1e-6], [1e-6, 1e-5]],
    "validity": {"speed": [0.0, 0.3]},
}


@pytest.mark.parametrize(
    ("change", "key", "remedy"),
    [
        ({"names": ["mass.totl", "tail.area"]}, "mass.totl", "did you mean 'mass.total'?"),
        ({"names": ["mass.total", "mass.total"]}, "names has a name twice", "once"),
        ({"names": "mass.total"}, "posterior", "as lists"),
        ({"mean": [2.0]}, "2 names, 1 means", "one mean"),
        ({"mean": [2.0, "x"]}, "posterior is 'x'", "plain number"),
        ({"covariance": [[1.0, 0.0]]}, "covariance rows of [2]", "one row"),
        ({"covariance": [[1.0, 2.0], [2.0, 1.0]]}, "covariance", "whole estimated covariance"),
        ({"covariance": [[1.0, 0.1], [0.0, 1.0]]}, "covariance", "whole estimated covariance"),
        ({"covariance": [[-1.0, 0.0], [0.0, 1.0]]}, "covariance", "whole estimated covariance"),
        ({"validity": [1]}, "posterior.validity is [1]", "keys and values"),
        ({"extra": 1}, "unknown key posterior.extra", "known keys"),
    ],
)
def test_a_wrong_posterior_fails(tmp_path, change, key, remedy):
    data = {**PRESET, "effects": {"servo_lag": {"time_constant": 0.05}}}
    load_changed(tmp_path, {**data, "posterior": POSTERIOR})
    with pytest.raises(ParameterError) as caught:
        load_changed(tmp_path, {**data, "posterior": {**POSTERIOR, **change}})
    assert "my-fish.yaml" in str(caught.value)
    assert key in str(caught.value)
    assert remedy in str(caught.value)


def test_a_boolean_is_no_number_even_where_one_would_do(tmp_path):
    with pytest.raises(ParameterError, match="bool"):
        load_fish("zheng-2021-a").replace({"mass.total": True})


def test_an_identified_inertia_may_break_the_triangle_rule_and_files_are_warned_of(tmp_path):
    fish = load_fish("zheng-2021-a")
    flat = {"inertia.rest[2]": 0.02}
    with pytest.raises(ParameterError, match="more than the other two together"):
        fish.replace(flat)
    effective = fish.replace(flat, status="identified", source="runs of May")
    file = tmp_path / "effective.yaml"
    with pytest.warns(UserWarning, match=r"inertia\.rest\[2\].*identified"):
        save_fish(effective, file)
    with pytest.warns(UserWarning, match=r"inertia\.rest\[2\].*identified"):
        assert load_fish(file).get("inertia.rest[2]") == 0.02


def test_central_inertia_of_a_neutral_fish_matches_the_parallel_axis_theorem():
    fish = load_fish("zheng-2021-a")
    # The centre of mass lies on the z axis at rest, so J_zz is shifted by nothing.
    inertia = central_inertia(fish)
    rest_x, block_x = -0.006 / 1.7, 0.030 + 0.010 - (0.035 - 0.015)
    expected = 0.0083 + 0.00008 + 1.7 * rest_x**2 + 0.3 * block_x**2
    assert inertia[2, 2] == pytest.approx(expected, rel=1e-12)
    assert np.linalg.eigvalsh(inertia)[0] > 0


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("name: [", "not valid YAML"),
        ("- a\n- b\n", "no 'key: value' sections"),
        ("", "no 'key: value' sections"),
        ("name: a\nname: b\n", "line 2: the key 'name' occurs twice"),
        ("? [a]\n: b\n", "not valid YAML"),
    ],
)
def test_a_file_that_is_no_mapping_fails(tmp_path, text, problem):
    file = tmp_path / "my-fish.yaml"
    file.write_text(text)
    with pytest.raises(ParameterError, match=r"my-fish\.yaml") as caught:
        load_fish(file)
    assert problem in str(caught.value)


def test_a_number_in_scientific_notation_without_a_point_is_a_number(tmp_path):
    text = yaml.safe_dump(PRESET).replace("area: 0.011\n", "area: 11e-3\n")
    assert "11e-3" in text
    file = tmp_path / "my-fish.yaml"
    file.write_text(text)
    assert load_fish(file).get("tail.area") == 0.011


def test_loading_a_preset_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_fish("msu-tail-fish")
