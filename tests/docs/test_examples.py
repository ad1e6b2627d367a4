"""The example files do what their page says."""

import shutil

import numpy as np
import pytest

from fish_env import InitialState, Simulator, load_fish
from fish_env.effects import load_effect_file
from fish_env.errors import EffectError
from tests.docs.pages import ROOT

EXAMPLES = ROOT / "examples"
SWIM = [{"t": 0.0, "tail_amplitude": 0.35, "tail_frequency": 2.0}]


def test_the_cable_drags_at_the_stern():
    """-c |v| v at (x, 0, 0), with v = V + omega x (x, 0, 0); its moment about O_b."""
    simulator = Simulator(EXAMPLES / "my-fish.yaml")
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
    with_cable = Simulator(file)
    without = Simulator(file, effects={"cable_drag": {"coefficient": 0.0}})
    slow, fast = (x.run(SWIM, duration_s=20.0)["x"][-1] for x in (with_cable, without))
    assert 0.2 * fast < slow < 0.95 * fast


def test_the_effect_is_refused_beyond_its_bounds():
    cable = load_effect_file(EXAMPLES / "cable_drag.py")
    with pytest.raises(EffectError, match="coefficient = -1"):
        Simulator("zheng-2021-a", effects={cable.name: {"coefficient": -1}}, user_effects=[cable])
