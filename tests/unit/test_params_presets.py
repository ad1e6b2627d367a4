"""The presets, the flat view of a fish, its priors and origins."""

import dataclasses
import math

import numpy as np
import pytest

from fish_env.errors import ParameterError
from fish_env.params import FishParams, list_fish, load_fish
from fish_env.params.packing import PATHS


@pytest.fixture(scope="module")
def fish() -> FishParams:
    return load_fish("zheng-2021-a")


@pytest.mark.parametrize("name", list_fish())
def test_presets_load_and_state_an_origin_for_every_value(name):
    preset = load_fish(name)
    assert preset.name == name
    for path in preset.values():
        info = preset.info(path)
        assert info.status == "reconstructed" or (preset.posterior and info.status == "identified")
        assert info.source
        assert info.lower <= info.value <= info.upper
        assert info.unit
        assert info.description
        assert info.symbol


def test_values_cover_the_record_that_kernels_read(fish):
    assert set(fish.values()) == set(PATHS.values())


def test_values_are_in_file_order_without_the_prior(fish):
    paths = list(fish.values())
    assert paths[:3] == ["water.density", "water.gravity", "mass.total"]
    assert paths[-1] == "body.rotational_damping[2]"
    assert not any(path.startswith("prior") for path in paths)


def test_fish_b_differs_from_fish_a_in_its_buoyancy_alone(fish):
    other = load_fish("zheng-2021-b").values()
    changed = {path for path, value in fish.values().items() if other[path] != value}
    assert changed == {"mass.buoyancy"}
    assert other["mass.buoyancy"] == 2.001


def test_get_follows_nested_and_indexed_paths(fish):
    assert fish.get("body.plane_xy.drag.c0") == 0.16
    assert fish.get("body.area[1]") == 0.0240
    assert fish.get("mass.static_moment_rest[0]") == -0.006


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("body.plane_xy.drag.c1", "did you mean 'body.plane_xy.drag.c"),
        ("mass.totl", "did you mean 'mass.total'?"),
        ("body.area", "name one of body.area[0], body.area[1], body.area[2]"),
        ("body.area[3]", "did you mean 'body.area["),
        ("prior.mass", "no parameter prior.mass"),
        ("zzz", "see values() for all paths"),
    ],
)
def test_an_unknown_path_names_the_closest_one(fish, path, hint):
    for ask in (fish.get, fish.info, fish.prior_sd, lambda path: fish.replace({path: 1.0})):
        with pytest.raises(ParameterError) as caught:
            ask(path)
        assert "zheng-2021-a.yaml" in str(caught.value)
        assert hint in str(caught.value)


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("water.density", 0.0),
        ("water.gravity", 0.0),
        ("mass.total", 0.01 * 2.0),
        ("mass.weight_block", 0.01 * 0.3),
        ("mass.buoyancy", 0.0002),
        ("mass.static_moment_rest[0]", 0.01 * 2.0 * 0.1),
        ("mass.static_moment_rest[1]", 0.01 * 2.0 * 0.1),
        ("inertia.rest[1]", 0.05 * 0.0087),
        ("inertia.weight_block[0]", 0.05 * 0.00006),
        ("weight_block.bracket_origin[0]", 0.01 * 0.030),
        ("weight_block.bracket_origin[1]", 0.0),
        ("weight_block.crank.l1", 0.01 * 0.022),
        ("tail.root[0]", 0.01 * 0.100),
        ("tail.center_of_pressure", 0.01 * 0.055),
        ("tail.area", 0.01 * 0.0110),
        ("body.area[2]", 0.01 * 0.0205),
        ("tail.lift.c1", 0.10 * 2.4),
        ("body.plane_xy.impact_moment", 0.10 * 0.080),
        ("body.rotational_damping[1]", 0.30 * 0.020),
    ],
)
def test_prior_sd_is_relative_by_group_in_the_value_s_own_unit(fish, path, expected):
    assert fish.prior_sd(path) == pytest.approx(expected, rel=1e-12)
    assert fish.info(path).prior_sd == fish.prior_sd(path)


def test_prior_sd_follows_the_file(fish):
    assert load_fish("msu-tail-fish").prior_sd("tail.lift.c1") == pytest.approx(0.5 * 2.4)


def test_prior_covariance_moves_the_buoyancy_with_the_mass(fish):
    paths = ["mass.total", "tail.area", "mass.buoyancy"]
    covariance = fish.prior_covariance(paths)
    difference = np.array([-1.0, 0.0, 1.0])
    assert math.sqrt(difference @ covariance @ difference) == pytest.approx(0.0002, rel=1e-6)
    assert covariance[2, 2] == pytest.approx(0.02**2 + 0.0002**2)
    assert covariance[1, 1] == pytest.approx(fish.prior_sd("tail.area") ** 2)
    assert np.linalg.eigvalsh(covariance)[0] > 0


def test_the_trim_does_not_depend_on_the_order_or_choice_of_paths(fish):
    paths = ["mass.total", "mass.buoyancy"]
    swapped = fish.prior_covariance(paths[::-1])
    np.testing.assert_array_equal(swapped, fish.prior_covariance(paths)[::-1, ::-1])
    assert fish.prior_covariance(["mass.buoyancy"]).shape == (1, 1)


def test_replace_changes_the_named_values_and_nothing_else(fish):
    changes = {"mass.total": 2.02, "body.area[1]": 0.03, "tail.drag.c0": np.float32(0.125)}
    other = fish.replace(changes, status="identified", source="runs of May")
    expected = {**fish.values(), **changes}
    assert other.values() == expected
    assert fish.get("mass.total") == 2.0
    assert type(other.get("tail.drag.c0")) is float
    for path in fish.values():
        origin = ("identified", "runs of May") if path in changes else None
        info = other.info(path)
        before = fish.info(path)
        assert (info.status, info.source) == (origin or (before.status, before.source))


def test_replace_without_status_keeps_what_was_said_of_the_value(fish):
    other = fish.replace({"mass.total": 2.02})
    assert other.info("mass.total").source == fish.info("mass.total").source
    assert other.info("mass.total").value == 2.02


def test_replace_checks_the_result(fish):
    with pytest.raises(ParameterError, match=r"mass\.total.*outside"):
        fish.replace({"mass.total": 0.0})


def test_a_fish_is_frozen(fish):
    with pytest.raises(dataclasses.FrozenInstanceError):
        fish.mass.total = 3.0
