"""Each checker fails on an environment with one thing broken."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.vector import RoboticFish3DVectorEnv
from tests.conformance import checkers
from tests.conformance.cases import MOVING_GOAL


class Broken(RoboticFish3DEnv):
    """Passes what a step returns through ``spoil``; the honest environment if that does nothing."""

    def spoil(self, obs, reward, terminated, truncated, info):
        return obs, reward, terminated, truncated, info

    def step(self, action):
        return self.spoil(*super().step(action))


class SeedIgnored(Broken):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None, options=options)


class SeedStuck(Broken):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=1, options=options)


class GlobalNoise(Broken):
    def spoil(self, obs, *rest):
        return obs + np.random.default_rng().normal(0, 1e-6, 33).astype(np.float32), *rest


class SeedShiftedByEpisode(Broken):
    """The seed is mixed with what ran before, so only the first use of it is reproducible."""

    def reset(self, *, seed=None, options=None):
        self.episodes = getattr(self, "episodes", -1) + 1
        seed = None if seed is None else seed + self.episodes
        return super().reset(seed=seed, options=options)


class NotANumber(Broken):
    def spoil(self, obs, *rest):
        obs[15] = np.nan if obs[15] > 0.2 else obs[15]
        return obs, *rest


class Unclipped(Broken):
    def spoil(self, obs, *rest):
        return obs * np.float32(50.0), *rest


class Swapped(Broken):
    def spoil(self, obs, *rest):
        obs[[16, 17]] = obs[[17, 16]]
        return obs, *rest


class WrongScale(Broken):
    def spoil(self, obs, *rest):
        obs[18] /= 2
        return obs, *rest


class HeadingOfTheInstant(Broken):
    def spoil(self, obs, *rest):
        obs[4:6] = obs[6:8]
        return obs, *rest


class Bonus(Broken):
    def spoil(self, obs, reward, *rest):
        return obs, reward + 1e-3, *rest


class TermMissing(Broken):
    def spoil(self, obs, reward, terminated, truncated, info):
        reward += info["cost_action"]
        return obs, reward, terminated, truncated, info | {"cost_action": 0.0}


class FastActuators(Broken):
    def reset(self, *, seed=None, options=None):
        result = super().reset(seed=seed, options=options)
        rows = self._batch._rows
        self._batch._data[rows.ROW_SLEW : rows.ROW_PAR] *= 1.001
        return result


class Nudged(Broken):
    def spoil(self, *result):
        self._batch._data[0] += 1e-11
        return result


class NoisyInfo(Broken):
    def spoil(self, obs, reward, terminated, truncated, info):
        return obs, reward, terminated, truncated, info | {"depth": info["depth"] + 1e-3}


def late(option):
    """The environment with a delay, where it has one, that is one physics step too long."""

    def make(**options):
        longer = {option: options[option] + 0.01} if option in options else {}
        return RoboticFish3DEnv(**options | longer)

    return make


def fine(environment, **options):
    """Makes an environment with a control step per physics step."""
    return lambda: environment(control_hz=100.0, **options)


def values(environment, delay=0.0, steps=0):
    """Runs the check of observation values."""
    options = {"observation_delay_s": delay} if delay else {}
    checkers.check_observation_values(fine(environment, **options), MOVING_GOAL, steps)


SINGLE = {
    "seed ignored": lambda: checkers.check_determinism(SeedIgnored),
    "seed stuck": lambda: checkers.check_determinism(SeedStuck),
    "noise from elsewhere": lambda: checkers.check_determinism(GlobalNoise),
    "seed depends on history": lambda: checkers.check_determinism(SeedShiftedByEpisode),
    "NaN": lambda: checkers.check_observations(NotANumber),
    "beyond the space": lambda: checkers.check_observations(Unclipped),
    "two observations swapped": lambda: values(Swapped),
    "a wrong scale": lambda: values(WrongScale),
    "instantaneous heading": lambda: values(HeadingOfTheInstant),
    "an info that is not the truth": lambda: values(NoisyInfo),
    "observation delay off by one": lambda: values(Broken, 0.14, 13),
    "observed too late": lambda: checkers.check_observation_delay(
        late("observation_delay_s"), 0.13
    ),
    "acted too late": lambda: checkers.check_action_delay(late("action_delay_s"), 0.13),
    "a bonus that is no term": lambda: checkers.check_reward(Bonus),
    "a term that costs nothing": lambda: checkers.check_reward(TermMissing),
    "too fast actuators": lambda: checkers.check_slew(FastActuators),
    "a nudge in each step": lambda: checkers.check_physics(Nudged, {}),
}


@pytest.mark.parametrize("check", SINGLE.values(), ids=SINGLE)
def test_a_broken_environment_is_noticed(check):
    """The checker raises, where the real environment passes (see the other files)."""
    with pytest.raises(AssertionError):
        check()


def test_an_honest_subclass_is_not():
    """The maker of broken environments breaks nothing by itself."""
    checkers.check_determinism(Broken)
    checkers.check_observations(Broken)
    values(Broken)
    checkers.check_reward(Broken)
    checkers.check_slew(Broken)
    checkers.check_physics(Broken, {})


class BrokenVector(RoboticFish3DVectorEnv):
    """Passes what a step returns through ``spoil``."""

    def spoil(self, obs, reward, terminated, truncated, infos):
        return obs, reward, terminated, truncated, infos

    def step(self, actions):
        return self.spoil(*super().step(actions))


class SameSeeds(BrokenVector):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=[seed] * self.num_envs, options=options)


class FinalOfTheNext(BrokenVector):
    """final_obs holds the first observation of the next episode."""

    def spoil(self, obs, *rest):
        for lane in np.flatnonzero(rest[-1].get("_final_obs", [])):
            rest[-1]["final_obs"][lane] = obs[lane].copy()
        return obs, *rest


class FinalOfAll(BrokenVector):
    """final_obs holds the whole batch in every row."""

    def spoil(self, obs, *rest):
        for lane in np.flatnonzero(rest[-1].get("_final_obs", [])):
            rest[-1]["final_obs"][lane] = obs.copy()
        return obs, *rest


class MaskOfAll(BrokenVector):
    def spoil(self, obs, *rest):
        if "_final_info" in rest[-1]:
            rest[-1]["_final_info"][:] = True
        return obs, *rest


class RewardInReset(BrokenVector):
    def spoil(self, obs, reward, *rest):
        return obs, np.where(reward == 0, 0.5, reward), *rest


class CrashTruncates(BrokenVector):
    def spoil(self, obs, reward, terminated, truncated, infos):
        return obs, reward, np.zeros_like(terminated), truncated | terminated, infos


class StaleObservation(BrokenVector):
    def spoil(self, obs, *rest):
        ended = rest[1] | rest[2]
        for lane in np.flatnonzero(ended & rest[-1].get("_final_obs", ended)):
            obs[lane] = rest[-1].get("final_obs", obs)[lane]
        return obs, *rest


class OneStepLonger(BrokenVector):
    def __init__(self, *args, max_episode_steps, **options):
        super().__init__(*args, max_episode_steps=max_episode_steps + 1, **options)


class MaskIgnored(BrokenVector):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=seed)


SAME, NEXT, OFF = AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED
VECTOR = {
    "fish alike": (SameSeeds, NEXT),
    "final_obs of the next episode": (FinalOfTheNext, SAME),
    "final_obs of all fish": (FinalOfAll, SAME),
    "masks of all fish": (MaskOfAll, SAME),
    "reward in a reset step": (RewardInReset, NEXT),
    "a crash that truncates": (CrashTruncates, NEXT),
    "the last observation instead of the first": (StaleObservation, SAME),
    "a step too many": (OneStepLonger, NEXT),
    "reset_mask ignored": (MaskIgnored, OFF),
}
NARROW = {
    "config": {"tank": {"walls": [-0.4, 0.4, -0.4, 0.4]}, "start": {"surge": [0.0, 0.4]}},
}
"""A tank in which fast fish hit a wall and slow ones reach the time limit."""


@pytest.mark.parametrize(("broken", "mode"), VECTOR.values(), ids=VECTOR)
def test_a_broken_batch_is_noticed(broken, mode):
    """Compared with Gymnasium's own vector of single environments."""
    with pytest.raises(AssertionError):
        checkers.check_vector(broken, 4, mode, NARROW, 200, 30)


@pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda mode: mode.name)
def test_an_honest_batch_passes(mode):
    """With the same settings; some fish crash and some reach the time limit, not all at once."""
    ends = checkers.check_vector(BrokenVector, 4, mode, NARROW, 200, 30)
    assert min(ends) > 0
