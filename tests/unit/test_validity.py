"""An identified fish says what its data covered, and whoever leaves that far behind is told."""

import dataclasses
import warnings

import gymnasium as gym
import pytest
import yaml

import fish_env
from fish_env import Simulator
from fish_env.data.validity import covered, far_outside
from fish_env.effects import catalogue
from fish_env.errors import ParameterError
from fish_env.params import Posterior, load_fish, save_fish

RANGES = {"tail_amplitude": [0.2, 0.4], "tail_frequency": [1.0, 2.0], "u": [0.0, 0.2]}
SWIM = {"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 2.0}
OUTSIDE = "tail_frequency 3.5 to 3.5 Hz .data: 1 to 2."
STILL = {"block_displacement": [-0.03, 0.03], "block_angle": [-0.6, 0.6]}
WIDE = {**STILL, "tail_offset": [-1.0, 1.0], "tail_amplitude": [0.0, 1.0]}


def identified(ranges, **changes):
    """The fish of a fit to data with these ranges."""
    posterior = Posterior(("mass.total",), (2.0,), ((1e-4,),), {"ranges": ranges})
    return dataclasses.replace(load_fish("zheng-2021-a"), posterior=posterior, **changes)


def told(act):
    """Messages of the warnings about ranges that a call gives."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        act()
    return [str(w.message) for w in caught if "identified from data" in str(w.message)]


def test_ranges_are_read_in_both_forms():
    expected = {"tail_amplitude": (0.2, 0.4), "tail_frequency": (1.0, 2.0), "u": (0.0, 0.2)}
    assert covered(identified(RANGES)) == expected
    flat = dataclasses.replace(identified({}).posterior, validity={**RANGES, "runs": ["a", "b"]})
    assert covered(dataclasses.replace(identified({}), posterior=flat)) == expected
    assert covered(load_fish("zheng-2021-a")) == {}


@pytest.mark.parametrize(
    ("asked", "outside"),
    [((0.0, 0.4), False), ((0.2, 0.49), False), ((0.2, 0.51), True), ((-0.2, 0.4), True)],
)
def test_rest_and_what_is_near_count_as_covered(asked, outside):
    assert bool(far_outside(identified(RANGES), {"tail_amplitude": asked})) == outside


def test_a_command_that_no_run_gave_is_outside_and_one_that_nothing_is_said_of_is_not():
    fish = identified({"block_angle": [0.0, 0.0]})
    (said,) = far_outside(fish, {"block_angle": (-0.1, 0.1), "tail_frequency": (9.0, 9.0)})
    assert said == "block_angle -0.1 to 0.1 rad (data: 0 to 0)"


def test_a_simulator_tells_once_which_command_and_what_to_do():
    simulator = Simulator(identified(RANGES))

    def swim(**commands):
        return told(lambda: simulator.run([{**SWIM, **commands}], duration_s=0.1))

    assert swim() == []
    (said,) = swim(tail_frequency=3.5)
    assert said.startswith("zheng-2021-a was identified from data that do not cover tail_frequency")
    assert "3.5 to 3.5 Hz (data: 1 to 2)" in said
    assert said.endswith("stay near them, or measure runs there and identify it again")
    assert swim(tail_frequency=3.6) == []


@pytest.mark.parametrize("make", [gym.make, gym.make_vec], ids=["one", "many"])
def test_an_environment_tells_it_when_it_is_made(make):
    def env(ranges):
        return told(lambda: make("RoboticFish3D-v0", fish=identified(ranges)).close())

    (said,) = env({**WIDE, "tail_frequency": [0.5, 1.0]})
    assert "cover tail_frequency 0 to" in said
    assert "narrow actuators in the settings (config)" in said
    assert env({**WIDE, "tail_frequency": [0.5, 9.0]}) == []


def test_an_extended_file_names_its_form_and_another_form_is_refused(tmp_path):
    file = tmp_path / "extended.yaml"
    save_fish(identified(RANGES), file)
    data = yaml.safe_load(file.read_text())
    assert data["format"] == "robofish-extended/1"
    assert load_fish(file) == identified(RANGES)
    del data["format"]
    file.write_text(yaml.safe_dump(data))
    assert load_fish(file) == identified(RANGES), "files of earlier versions have no format"
    file.write_text(yaml.safe_dump({**data, "format": "robofish-extended/2"}))
    with pytest.raises(ParameterError, match="update robotic-fish"):
        load_fish(file)


@pytest.mark.parametrize("name", sorted(catalogue()))
@pytest.mark.parametrize("end", [0, 1], ids=["low", "high"])
def test_an_extended_file_with_any_effect_loads_into_the_environment(tmp_path, name, end):
    """At both ends of what a diagnosis may estimate: on the motion, on sensors, on clocks."""
    values = {p.name: p.plausible[end] for p in catalogue()[name].parameters}
    paths = ["mass.total", *(f"effects.{name}.{p}" for p in values)]
    rows = tuple(tuple(1e-8 * (i == j) for j in paths) for i in paths)
    posterior = Posterior(tuple(paths), (2.0, *values.values()), rows, {"ranges": {}})
    fish = dataclasses.replace(
        load_fish("zheng-2021-a"), effects={name: values}, posterior=posterior
    )
    save_fish(fish, tmp_path / "extended.yaml")
    for options in ({}, {"randomization": "posterior"}):
        env = gym.make("RoboticFish3D-v0", fish=str(tmp_path / "extended.yaml"), **options)
        assert env.unwrapped.options.model.fish.effects == fish.effects
        env.close()


def test_the_package_still_finds_the_shipped_identified_fish():
    assert covered(fish_env.load_fish("msu-tail-fish-identified"))["tail_frequency"] == (1.0, 1.0)
