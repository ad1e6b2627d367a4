"""What a privileged critic sees: the goals to come, the water, the parameters, the true state."""

import numpy as np
import pytest

from fish_env.envs.layout import GOAL, OBSERVATION, OUTPUTS, REFERENCE
from fish_env.envs.vector import RoboticFish3DVectorEnv
from robofish_agents.training.privileged import (
    AHEAD_S,
    SCALE,
    Sight,
    drawn,
    flow,
    foreseeable,
    future,
    reference,
)

COUNT = 24
WATER = {
    "effects.current.north": [-0.02, 0.02],
    "effects.current.east": [-0.02, 0.02],
    "mass.buoyancy": {"sd": 0.001},
}


def fish(count=COUNT, **options) -> RoboticFish3DVectorEnv:
    env = RoboticFish3DVectorEnv(count, threads=1, task="track", **options)
    env.reset(seed=5)
    return env


@pytest.fixture(scope="module")
def randomised() -> RoboticFish3DVectorEnv:
    return fish(randomization=WATER, observation_noise={"depth": 0.05}, observation_delay_s=0.1)


def output(env, name):
    return env.batch.outputs[OUTPUTS.index(name)].copy()


@pytest.mark.parametrize("name", ["depth", "heading"])
def test_the_future_of_a_goal_comes(name):
    """All signals, up to 20 s: steps, ramps and sines have begun by then."""
    env = fish()
    changes, goals = [], [output(env, f"goal_{name}")]
    for _ in range(200):
        changes.append(future(env.batch)[("depth", "heading").index(name)] * SCALE[name])
        env.batch.step(np.zeros((COUNT, 5)))
        goals.append(output(env, f"goal_{name}"))
    moved = 0
    for step in range(160):
        for ahead, change in zip(AHEAD_S, changes[step], strict=True):
            came = goals[step + round(10.0 * ahead)] - goals[step]
            np.testing.assert_allclose(change, came, atol=1e-9)
            moved += np.sum(np.abs(came) > 0.01)
    assert moved > 1000


def test_a_teacher_foresees_sines_but_no_steps():
    """It expects no step, knows a sine, and takes a ramp to go on."""
    env = fish(60)
    goal, ahead = env.batch.goal, AHEAD_S.index(4.0)
    row = {name: goal[GOAL.index(f"depth_{name}")] for name in REFERENCE}
    step, sine, ramp = (row[name] != 0.0 for name in ("step", "sine_amplitude", "ramp_rate"))
    unexpected = foreseen = followed = 0
    for _ in range(150):
        env.batch.step(np.zeros((60, 5)))
        now = env.batch.time
        expected, comes = foreseeable(env.batch)[0][ahead], future(env.batch)[0][ahead]
        assert not expected[step].any()
        unexpected += np.sum(comes[step] != 0.0)
        np.testing.assert_allclose(expected[sine], comes[sine], atol=1e-9)
        foreseen += np.sum(comes[sine] != 0.0)
        going = ramp & (now >= row["ramp_start"]) & (now + 4.0 < row["ramp_end"])
        np.testing.assert_allclose(expected[going], comes[going], atol=1e-9)
        followed += np.sum(going)
        assert not expected[ramp & (now < row["ramp_start"])].any()
    assert min(unexpected, foreseen, followed) > 100


def test_the_goal_of_now_is_that_of_the_environment():
    env = fish()
    for _ in range(120):
        env.batch.step(np.zeros((COUNT, 5)))
    now = reference(env.batch.goal, "depth", env.batch.time)
    np.testing.assert_allclose(now, output(env, "goal_depth"), atol=1e-9)


def test_water_is_seen_along_and_across_the_fish(randomised):
    batch = randomised.batch
    heading = output(randomised, "heading")
    north, east = (batch.drawn[f"effects.current.{axis}"] / 0.02 for axis in ("north", "east"))
    along, across = flow(batch)
    np.testing.assert_allclose(along, np.cos(heading) * north + np.sin(heading) * east, atol=1e-6)
    np.testing.assert_allclose(across, np.cos(heading) * east - np.sin(heading) * north, atol=1e-6)
    assert not flow(fish(3).batch).any()


def test_parameters_are_scaled_by_their_distribution(randomised):
    batch = randomised.batch
    nominal = batch.options.model.fish.get("mass.buoyancy")
    expected = (batch.drawn["mass.buoyancy"] - nominal) / 0.001
    np.testing.assert_allclose(drawn(batch, "mass.buoyancy"), expected)
    scaled = drawn(batch, "effects.current.north")
    np.testing.assert_allclose(scaled, batch.drawn["effects.current.north"] / 0.02)
    assert np.abs(scaled).max() <= 1.0
    assert not drawn(batch, "inertia.rest[0]").any()


def test_batches_that_draw_different_parameters_stand_side_by_side(randomised):
    calm = fish(4)
    sight = Sight([calm.batch, randomised.batch])
    seen = sight.see(np.concatenate([calm.batch.obs, randomised.batch.obs]))
    assert seen.shape == (4 + COUNT, sight.width)
    assert seen.dtype == np.float32
    own = seen[:, sight.present - len(sight.paths) : sight.present]
    assert own.shape == (4 + COUNT, 3)
    assert not own[:4].any()
    assert own[4:].all()


def test_the_true_depth_is_seen_in_place_of_the_noisy_one(randomised):
    batch = randomised.batch
    seen = Sight([batch]).see(batch.obs)
    true = output(randomised, "depth_error") / 0.3
    np.testing.assert_allclose(seen[:, 0], true, atol=1e-5)
    assert np.abs(batch.obs[:, 0] - true).max() > 0.05
    assert OBSERVATION[0][0].startswith("depth error")
