"""Parameters drawn in each episode: which distribution, per episode, reported, refused."""

import dataclasses

import numpy as np
import pytest

from fish_env.envs.options import env_options
from fish_env.envs.randomization import TRUNCATE
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError, EffectError, ParameterError
from fish_env.params.io import load_fish
from fish_env.params.provenance import Posterior

MASS = "mass.total"
SHRINK = 0.9546  # standard deviation of a normal that is cut off at 2.5 of its own
COUNT = 20_000


def draws(spec, count=COUNT, **options):
    """Values drawn for a specification, path -> (count,)."""
    random = env_options(randomization=spec, **options).random
    return random.draw(np.random.default_rng(0).random((len(random.paths), count)))


def test_mappings_draw_the_stated_distributions():
    """Uniform between the ends; normal about the nominal value, cut off at 2.5 deviations."""
    fish = load_fish("zheng-2021-a")
    spec = {MASS: {"relative": 0.1}, "tail.area": {"sd": 0.001}, "body.area[0]": [0.01, 0.02]}
    drawn = draws(spec)
    for path, sd in ((MASS, 0.1 * fish.get(MASS)), ("tail.area", 0.001)):
        assert drawn[path].mean() == pytest.approx(fish.get(path), abs=4 * sd / COUNT**0.5)
        assert drawn[path].std() == pytest.approx(SHRINK * sd, rel=0.02)
        assert np.abs(drawn[path] - fish.get(path)).max() <= TRUNCATE * sd * (1 + 1e-9)
    area = drawn["body.area[0]"]
    assert (area.min(), area.max()) == pytest.approx((0.01, 0.02), abs=1e-5)
    assert area.std() == pytest.approx(0.01 / 12**0.5, rel=0.02)


def test_the_prior_is_that_of_the_file():
    """Every parameter with a prior, and mass and buoyancy together: their difference is known."""
    fish = load_fish("zheng-2021-a")
    drawn = draws("prior")
    assert set(drawn) == {path for path in fish.values() if fish.prior_sd(path) > 0}
    assert drawn[MASS].std() == pytest.approx(SHRINK * fish.prior_sd(MASS), rel=0.02)
    trim = drawn["mass.buoyancy"] - drawn[MASS]
    assert trim.std() == pytest.approx(SHRINK * 0.0002, rel=0.05)
    assert trim.std() < 0.02 * drawn[MASS].std()


def test_the_posterior_is_that_of_the_file():
    """Mean, deviations and correlation of an identified fish, effects included."""
    names = ("tail.drag.c0", "effects.current.north")
    covariance = np.array([[0.01**2, 0.8e-4], [0.8e-4, 0.01**2]])
    posterior = Posterior(names, np.array([0.08, 0.02]), covariance, {})
    effects = {"current": {"north": 0.0}}
    fish = dataclasses.replace(load_fish("zheng-2021-a"), effects=effects, posterior=posterior)
    drawn = np.array(list(draws("posterior", fish=fish).values()))
    np.testing.assert_allclose(drawn.mean(1), [0.08, 0.02], atol=3e-4)
    np.testing.assert_allclose(np.cov(drawn) / SHRINK**2, covariance, rtol=0.03)


def test_each_episode_draws_anew_and_reports_what_holds():
    """reset's info names every drawn parameter, and the physics computes with that number."""
    env = RoboticFish3DEnv(randomization={MASS: [1.9, 2.1]})
    row = env.options.model.kernels.parameter_names.index("mass_total")
    seen = []
    for _ in range(5):
        info = env.reset(seed=None if seen else 7)[1]
        seen.append(info[f"parameter/{MASS}"])
        assert env._batch.records[row, 0] == seen[-1]
        assert f"parameter/{MASS}" not in env.step(np.zeros(5, np.float32))[4]
    assert len(set(seen)) == 5
    assert env.reset(seed=7)[1][f"parameter/{MASS}"] == seen[0]


def test_what_a_user_fixes_wins_over_the_draw_and_is_reported():
    """options["parameters"] holds for that episode alone."""
    env = RoboticFish3DEnv(randomization="prior")
    fixed = env.reset(seed=1, options={"parameters": {"tail.area": 0.02}})[1]
    assert fixed["parameter/tail.area"] == 0.02
    assert env.reset(seed=1)[1]["parameter/tail.area"] != 0.02


def test_the_fish_of_a_batch_differ():
    """Each lane draws from its own generator, and the lanes that start report."""
    env = RoboticFish3DVectorEnv(6, randomization={MASS: [1.9, 2.1]})
    infos = env.reset(seed=0)[1]
    assert len(set(infos[f"parameter/{MASS}"])) == 6
    mask = np.array([True, False, True, False, False, False])
    infos = env.reset(options={"reset_mask": mask})[1]
    np.testing.assert_array_equal(infos[f"_parameter/{MASS}"], mask)
    assert np.all(infos[f"parameter/{MASS}"][~mask] == 0)


@pytest.mark.parametrize("spec", ["prior", "posterior"])
def test_a_fish_draws_alike_alone_and_in_a_batch(spec):
    """Correlated draws too, to the last bit, whatever the size of the batch."""
    fish = load_fish("zheng-2021-a")
    names = tuple(path for path in fish.values() if fish.prior_sd(path) > 0)
    mixing = np.random.default_rng(1).normal(size=(len(names), len(names)))
    sd = np.array([fish.prior_sd(path) for path in names]) / np.linalg.norm(mixing, axis=1)
    mixing *= sd[:, None]
    mean = np.array([fish.get(path) for path in names])
    posterior = Posterior(names, mean, mixing @ mixing.T, {})
    random = env_options(
        fish=dataclasses.replace(fish, posterior=posterior), randomization=spec
    ).random
    uniforms = np.random.default_rng(0).random((len(names), 37))
    together = random.draw(uniforms)
    for lane in range(37):
        alone = random.draw(uniforms[:, [lane]])
        assert all(alone[path][0] == together[path][lane] for path in names)


def test_randomised_effects_need_not_be_switched_on():
    """Naming an effect's parameter brings its kernel in."""
    env = RoboticFish3DEnv(randomization={"effects.current.north": [-0.1, 0.1]})
    value = env.reset(seed=2)[1]["parameter/effects.current.north"]
    row = env.options.model.kernels.parameter_names.index("current.north")
    assert env._batch.records[row, 0] == value != 0


REFUSED = [
    ("pior", ConfigError, "give 'prior', 'posterior' or a mapping"),
    ({}, ConfigError, "give 'prior', 'posterior' or a mapping"),
    ("posterior", ConfigError, "carries no posterior"),
    ({"mass.totl": [1, 2]}, ParameterError, "did you mean 'mass.total'"),
    ({"effects.currnt.north": [0, 1]}, ConfigError, "no effect parameter"),
    ({"effects.current.west": [0, 1]}, ConfigError, "no effect parameter"),
    ({MASS: 2.0}, ConfigError, "'mass.total': give"),
    ({MASS: [2.1, 1.9]}, ConfigError, "'mass.total': give"),
    ({MASS: ["a", "b"]}, ConfigError, "'mass.total': give"),
    ({MASS: {"sd": -1}}, ConfigError, "'mass.total': give"),
    ({MASS: {"var": 1}}, ConfigError, "'mass.total': give"),
    ({MASS: [-3, -1]}, ConfigError, "leaves its bounds"),
    ({"effects.current.north": {"relative": 0.1}}, ConfigError, "nothing varies"),
    ({"effects.servo_lag.time_constant": [0.0, 0.1]}, EffectError, "shorter than"),
]


@pytest.mark.parametrize(("spec", "error", "message"), REFUSED, ids=[str(r[0]) for r in REFUSED])
def test_wrong_randomizations_are_refused_by_name(spec, error, message):
    """Also draws that could do nothing, leave the bounds or outrun the physics step."""
    with pytest.raises(error, match=message):
        env_options(randomization=spec)
