"""The example files do what their page says."""

import importlib
import shutil
import sys

import numpy as np
import pytest

from fish_env import InitialState, Simulator, load_fish
from fish_env.effects import load_effect_file
from fish_env.errors import EffectError
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.pipeline import infer
from tests.docs.pages import ROOT

EXAMPLES = ROOT / "examples"
SWIM = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]


def test_the_cable_drags_at_the_stern():
    """-c |v| v at (x, 0, 0), with v = V + omega x (x, 0, 0); its moment about O_b."""
    simulator = Simulator(EXAMPLES / "my-fish.yaml", trust_effects=True)
    velocity, omega = np.array([0.2, 0.05, -0.03]), np.array([0.3, -0.2, 0.5])
    state = InitialState(velocity_body=tuple(velocity), angular_velocity_body=tuple(omega))
    arm = np.array([-0.14, 0.0, 0.0])
    flow = velocity + np.cross(omega, arm)
    force = -0.5 * np.linalg.norm(flow) * flow
    wrench = simulator.wrench_by_term(state.vector())["cable_drag"]
    np.testing.assert_allclose(wrench, [*force, *np.cross(arm, force)], atol=1e-15)


def test_the_fish_is_what_its_file_says():
    fish = load_fish(EXAMPLES / "my-fish.yaml")
    base = load_fish("zheng-2021-a")
    assert fish.get("mass.buoyancy") == 2.001
    assert fish.info("mass.buoyancy").status == "identified"
    assert list(fish.tables()) == ["tail.drag"]
    assert fish.get("body.area[0]") == base.get("body.area[0]")
    assert set(fish.effects) == {"servo_lag", "cable_drag"}


def test_a_cable_slows_the_fish(tmp_path):
    file = shutil.copy(EXAMPLES / "my-fish.yaml", tmp_path)
    for name in ("my-drag.csv", "cable_drag.py"):
        shutil.copy(EXAMPLES / name, tmp_path)
    with_cable = Simulator(file, trust_effects=True)
    off = {"cable_drag": {"coefficient": 0.0}}
    without = Simulator(file, effects=off, trust_effects=True)
    slow, fast = (x.run(SWIM, duration_s=20.0)["x"][-1] for x in (with_cable, without))
    assert 0.2 * fast < slow < 0.95 * fast


def test_the_effect_is_refused_beyond_its_bounds():
    cable = load_effect_file(EXAMPLES / "cable_drag.py")
    with pytest.raises(EffectError, match="coefficient = -1"):
        Simulator("zheng-2021-a", effects={cable.name: {"coefficient": -1}}, user_effects=[cable])


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {EffectParameterId("headwind", "force"): 0.5},
        {EffectParameterId("air_drag", "k"): 0.5},
    ],
)
def test_the_rover_says_what_it_lacks(effects):
    sys.path.insert(0, str(EXAMPLES))
    try:
        rover = importlib.import_module("rover")
    finally:
        sys.path.remove(str(EXAMPLES))
    rng = np.random.default_rng(1)
    clock = np.arange(0.0, 60.0, 0.1)
    throttle = np.repeat(rng.uniform(-1.0, 1.0, (3, 12)), 50, axis=1)
    still = rover.Rover(clock, throttle, np.zeros(throttle.shape))
    truth = {id: np.array([value]) for id, value in effects.items()}
    driven = -still.innovations(np.array([[0.5], [-1.0]]), truth, rover.White(1.0), ())
    speed = driven.reshape(throttle.shape) + 0.05 * rng.standard_normal(throttle.shape)
    result = infer(rover.Rover(clock, throttle, speed))
    assert result.verdict.causes == tuple(id.effect for id in effects)
    assert result.verdict.name == ("cause" if effects else "no_misfit")
    for id, value in effects.items():
        found = result.accepted.interval(id, level=0.999)
        assert found[0] < value < found[1]
