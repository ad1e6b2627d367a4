"""Current, wave, and fish of all kinds: presets, files, extended models, effects of one's own."""

import numpy as np
import pytest

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.errors import EffectError
from fish_env.params.io import load_fish
from tests.conformance import checkers
from tests.conformance.cases import REST, REST_ACTION, START, random_actions, run

DEEP = {"tank": {"depth": 6.0}, "goal": {"depth": [2.9, 3.1]}}


@pytest.mark.parametrize("flow", [(0.1, -0.05, 0.02), (0.0, 0.3, 0.0)])
def test_a_current_carries_a_passive_fish(flow):
    """A fish that drifts with the water goes with it at its speed, and shows it over ground."""
    env = RoboticFish3DEnv(current=flow, config=DEEP)
    state = {**REST, "position": [0, 0, 3.0], "velocity_body": list(flow)}
    still = np.repeat(REST_ACTION[None], 100, axis=0)
    obs, _, _ = run(env, still, state=state)
    moved = np.array([env.state[axis] for axis in "xyz"]) - [0, 0, 3.0]
    np.testing.assert_allclose(moved, 10.0 * np.array(flow), atol=1e-9)
    np.testing.assert_allclose(obs[-1, 15:18], np.array(flow) / 0.2, atol=1e-6)


def test_a_current_pulls_a_fish_at_rest_along():
    """From rest it speeds up towards the water's speed, never beyond."""
    env = RoboticFish3DEnv(current=(0.2, 0.0, 0.0), config=DEEP)
    state = {**REST, "position": [0, 0, 3.0]}
    _, _, infos = run(env, np.repeat(REST_ACTION[None], 600, axis=0), state=state)
    north = np.array([info["north"] for info in infos])
    speed = np.diff(north) / 0.1
    assert np.all(np.diff(speed) > -1e-6)
    assert 0.15 < speed[-1] < 0.2


def test_swimming_in_a_current_is_swimming_in_a_moving_frame():
    """Same actions, same start relative to the water: the same motion plus the drift.

    To the accuracy of the integration, whose errors depend on the frame.
    """
    flow = np.array([0.08, -0.06, 0.03])
    actions = random_actions(40, seed=6)
    paths = []
    for env in (RoboticFish3DEnv(config=DEEP), RoboticFish3DEnv(config=DEEP, current=tuple(flow))):
        velocity = np.zeros(3) if not paths else flow
        state = {**REST, "position": [0, 0, 3.0], "velocity_body": velocity.tolist()}
        run(env, actions, state=state)
        paths.append(
            np.array([env.state[name] for name in ("x", "y", "z", "qw", "qx", "qy", "qz")])
        )
    drift = np.append(4.0 * flow, np.zeros(4))
    np.testing.assert_allclose(paths[1], paths[0] + drift, atol=1e-6)


def test_a_wave_heaves_the_fish_less_the_deeper_it_swims():
    """Up and down with its period, in phase with the episode's clock, decaying with depth."""
    wave = {"amplitude": 0.2, "frequency": 0.5}
    swings = []
    for depth in (0.5, 2.5):
        env = RoboticFish3DEnv(wave=wave, config=DEEP)
        state = {**REST, "position": [0, 0, depth]}
        _, _, infos = run(env, np.repeat(REST_ACTION[None], 200, axis=0), state=state)
        speed = np.diff([info["depth"] for info in infos])
        spectrum = np.abs(np.fft.rfft(speed))
        assert np.argmax(spectrum[1:]) + 1 == 10  # 0.5 Hz over 20 s
        swings.append(spectrum[10])
    assert swings[0] > 3 * swings[1]


def test_a_drawn_phase_makes_each_episode_meet_another_sea():
    """Randomisation reaches the wave as it reaches the fish."""
    env = RoboticFish3DEnv(
        wave={"amplitude": 0.2}, randomization={"effects.wave.phase": [-3.1, 3.1]}, config=DEEP
    )
    still = np.repeat(REST_ACTION[None], 10, axis=0)
    state = {**REST, "position": [0, 0, 0.5]}
    ends = [run(env, still, seed, state=state)[2][-1]["depth"] for seed in range(4)]
    assert np.ptp(ends) > 1e-3


EXTENDED = """
base: zheng-2021-a
name: refitted
tail: {area: 0.0087}
effects:
  servo_lag: {time_constant: 0.08}
  current: {north: 0.05}
"""


def test_an_extended_model_swims_with_its_effects(tmp_path):
    """A file with effects equals the preset with the same effects as an option."""
    path = tmp_path / "refitted.yaml"
    path.write_text(EXTENDED)
    effects = {"servo_lag": {"time_constant": 0.08}, "current": {"north": 0.05}}
    changed = load_fish("zheng-2021-a").replace({"tail.area": 0.0087})
    actions = random_actions(30)
    seen = [
        run(env, actions, **START)[0]
        for env in (RoboticFish3DEnv(fish=path), RoboticFish3DEnv(fish=changed, effects=effects))
    ]
    np.testing.assert_array_equal(*seen)
    assert not np.array_equal(seen[0], run(RoboticFish3DEnv(), actions, **START)[0])
    checkers.check_physics(RoboticFish3DEnv, {"fish": path})


OWN_EFFECT = '''
"""A leaking air bladder: the fish is heavier than it was."""

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def pull(motion, tail, inputs, centre, fish, e):
    """A force downward, body frame."""
    r = motion.attitude
    return Wrench(r.zx * e.force, r.zy * e.force, r.zz * e.force, 0.0, 0.0, 0.0)


EFFECT = Effect(
    name="leak",
    section="hydrostatics",
    summary="The fish sinks.",
    equation="F_down = force",
    source="made up",
    parameters=(EffectParameter("force", "N", 0.0, -5.0, 5.0, (0.0, 0.1), "net weight"),),
    hooks={"wrench": pull},
)
'''


@pytest.mark.slow
@pytest.mark.long
def test_an_effect_of_ones_own_lies_beside_the_fish(tmp_path):
    """<name>.py beside the YAML is found, compiled in, and can be changed for an episode."""
    fish = tmp_path / "leaky.yaml"
    fish.write_text("base: zheng-2021-a\nname: leaky\neffects: {leak: {force: 0.02}}\n")
    with pytest.raises(EffectError, match=r"put leak\.py beside the fish file"):
        RoboticFish3DEnv(fish=fish)
    (tmp_path / "leak.py").write_text(OWN_EFFECT)
    env = RoboticFish3DEnv(fish=fish, trust_effects=True)
    still = np.repeat(REST_ACTION[None], 10, axis=0)
    sunk = []
    for parameters in ({}, {"effects.leak.force": 0.04}, {"effects.leak.force": 0.0}):
        run(env, still, **START, parameters=parameters)
        sunk.append(env.state["z"] - 0.5)
    # Half a second squared times force over mass (2 kg), while the fish is slow.
    np.testing.assert_allclose(sunk, [0.005, 0.01, 0.0], rtol=0.03, atol=1e-12)
    with pytest.raises(EffectError, match="leak"):
        env.reset(options={"parameters": {"effects.leak.force": 9.0}})
