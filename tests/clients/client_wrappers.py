"""Every wrapper of Gymnasium, for one environment and for many."""

import importlib

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.spaces import Box, Dict
from gymnasium.wrappers import vector

from tests.clients.running import ENV

SMALL = {"render_size": (64, 48)}
HALF = Box(-1.0, 1.0, (33,), np.float32)
WHOLE = Box(-10.0, 10.0, (33,), np.float32)
PICTURES = {"render_mode": "rgb_array", **SMALL}


class Named(wrappers.TransformObservation):
    """The observation as a dictionary, for wrappers that filter or flatten one."""

    def __init__(self, env):
        space = Dict({"fish": WHOLE, "depth": Box(-10, 10, (1,), np.float32)})
        super().__init__(env, lambda seen: {"fish": seen, "depth": seen[..., :1]}, space)


def named(envs):
    """As :class:`Named`, of many."""
    return vector.VectorizeTransformObservation(envs, Named)


def shown(env):
    """The picture as the observation."""
    return wrappers.AddRenderObservation(env, render_only=True)


LEFT_OUT = {
    "AtariPreprocessing": "for Atari games only",
    "JaxToNumpy": "for environments that speak JAX",
    "JaxToTorch": "for environments that speak JAX",
}
MANY_LEFT_OUT = {
    "JaxToNumpy": "for environments that speak JAX",
    "JaxToTorch": "for environments that speak JAX",
    "GrayscaleObservation": "for observations that are pictures; ours are none in a batch",
    "ResizeObservation": "for observations that are pictures; ours are none in a batch",
}
"""Wrappers that are for other environments, and why."""

SINGLE = {
    "AddRenderObservation": lambda env, _: shown(env),
    "AddWhiteNoise": lambda env, _: wrappers.AddWhiteNoise(env, 0.5),
    "ArrayConversion": lambda env, _: wrappers.ArrayConversion(env, np, np),
    "Autoreset": lambda env, _: wrappers.Autoreset(env),
    "ClipAction": lambda env, _: wrappers.ClipAction(env),
    "ClipReward": lambda env, _: wrappers.ClipReward(env, -1.0, 1.0),
    "DelayObservation": lambda env, _: wrappers.DelayObservation(env, 2),
    "DiscretizeAction": lambda env, _: wrappers.DiscretizeAction(env, 3),
    "DiscretizeObservation": lambda env, _: wrappers.DiscretizeObservation(env, 3, True),
    "DtypeObservation": lambda env, _: wrappers.DtypeObservation(env, np.float64),
    "FilterObservation": lambda env, _: wrappers.FilterObservation(Named(env), ["depth"]),
    "FlattenObservation": lambda env, _: wrappers.FlattenObservation(Named(env)),
    "FrameStackObservation": lambda env, _: wrappers.FrameStackObservation(env, 3),
    "GrayscaleObservation": lambda env, _: wrappers.GrayscaleObservation(shown(env)),
    "HumanRendering": lambda env, _: wrappers.HumanRendering(env),
    "MaxAndSkipObservation": lambda env, _: wrappers.MaxAndSkipObservation(env, 2),
    "NormalizeObservation": lambda env, _: wrappers.NormalizeObservation(env),
    "NormalizeReward": lambda env, _: wrappers.NormalizeReward(env),
    "NumpyToTorch": lambda env, _: wrappers.NumpyToTorch(env),
    "ObstructView": lambda env, _: wrappers.ObstructView(env, 0.2, 8),
    "OrderEnforcing": lambda env, _: wrappers.OrderEnforcing(env),
    "PassiveEnvChecker": lambda env, _: wrappers.PassiveEnvChecker(env),
    "RecordEpisodeStatistics": lambda env, _: wrappers.RecordEpisodeStatistics(env),
    "RecordVideo": lambda env, folder: wrappers.RecordVideo(env, str(folder)),
    "RenderCollection": lambda env, _: wrappers.RenderCollection(env),
    "RescaleAction": lambda env, _: wrappers.RescaleAction(env, np.float32(-2), np.float32(2)),
    "RescaleObservation": lambda env, _: wrappers.RescaleObservation(
        env, np.float32(-1), np.float32(1)
    ),
    "ReshapeObservation": lambda env, _: wrappers.ReshapeObservation(env, (3, 11)),
    "ResizeObservation": lambda env, _: wrappers.ResizeObservation(shown(env), (24, 32)),
    "StickyAction": lambda env, _: wrappers.StickyAction(env, 0.5),
    "TimeAwareObservation": lambda env, _: wrappers.TimeAwareObservation(env),
    "TimeLimit": lambda env, _: wrappers.TimeLimit(env, 15),
    "TransformAction": lambda env, _: wrappers.TransformAction(env, np.negative, env.action_space),
    "TransformObservation": lambda env, _: wrappers.TransformObservation(env, np.tanh, HALF),
    "TransformReward": lambda env, _: wrappers.TransformReward(env, abs),
}

MANY = {
    "ArrayConversion": lambda env, _: vector.ArrayConversion(env, np, np),
    "ClipAction": lambda env, _: vector.ClipAction(env),
    "ClipReward": lambda env, _: vector.ClipReward(env, -1.0, 1.0),
    "DictInfoToList": lambda env, _: vector.DictInfoToList(env),
    "DtypeObservation": lambda env, _: vector.DtypeObservation(env, np.float64),
    "FilterObservation": lambda env, _: vector.FilterObservation(named(env), ["depth"]),
    "FlattenObservation": lambda env, _: vector.FlattenObservation(named(env)),
    "HumanRendering": lambda env, _: vector.HumanRendering(env),
    "NormalizeObservation": lambda env, _: vector.NormalizeObservation(env),
    "NormalizeReward": lambda env, _: vector.NormalizeReward(env),
    "NumpyToTorch": lambda env, _: vector.NumpyToTorch(env),
    "RecordEpisodeStatistics": lambda env, _: vector.RecordEpisodeStatistics(env),
    "RecordVideo": lambda env, folder: vector.RecordVideo(
        env, str(folder), episode_trigger=lambda episode: episode == 0, video_length=5
    ),
    "RescaleAction": lambda env, _: vector.RescaleAction(env, np.float32(-2), np.float32(2)),
    "RescaleObservation": lambda env, _: vector.RescaleObservation(
        env, np.float32(-1), np.float32(1)
    ),
    "ReshapeObservation": lambda env, _: vector.ReshapeObservation(env, (3, 11)),
    "TransformAction": lambda env, _: vector.TransformAction(env, np.negative),
    "TransformObservation": lambda env, _: vector.TransformObservation(env, np.tanh),
    "TransformReward": lambda env, _: vector.TransformReward(env, np.abs),
    "VectorizeTransformAction": lambda env, _: vector.VectorizeTransformAction(
        env, wrappers.ClipAction
    ),
    "VectorizeTransformObservation": lambda env, _: vector.VectorizeTransformObservation(
        env, wrappers.TransformObservation, func=np.tanh, observation_space=HALF
    ),
    "VectorizeTransformReward": lambda env, _: vector.VectorizeTransformReward(
        env, wrappers.TransformReward, func=np.abs
    ),
}


def test_no_wrapper_is_left_out():
    """A later Gymnasium may have more."""
    parts = (("wrappers", SINGLE, LEFT_OUT), ("wrappers.vector", MANY, MANY_LEFT_OUT))
    for module, tried, left in parts:
        names = set(importlib.import_module(f"gymnasium.{module}").__all__) - {"vector"}
        assert names == {*tried, *left}


@pytest.mark.parametrize("name", SINGLE)
def test_a_wrapper_of_one_fish(name, tmp_path):
    env = SINGLE[name](gym.make(ENV, **PICTURES), tmp_path)
    seen, _ = env.reset(seed=0)
    for step in range(30):
        assert _holds(env.observation_space, seen), step
        action = env.action_space.sample()
        if name == "NumpyToTorch":
            import torch

            action = torch.as_tensor(action)
        seen, reward, terminated, truncated, _ = env.step(action)
        assert np.isfinite(float(reward))
        if name == "HumanRendering":
            env.render()
        if (terminated or truncated) and name != "Autoreset":
            seen, _ = env.reset()
    env.close()
    if name == "RecordVideo":
        assert list(tmp_path.glob("*.mp4"))


@pytest.mark.parametrize("name", MANY)
def test_a_wrapper_of_many_fish(name, tmp_path):
    envs = MANY[name](gym.make_vec(ENV, 3, **PICTURES), tmp_path)
    seen, _ = envs.reset(seed=0)
    for _ in range(30):
        assert len(next(iter(seen.values())) if isinstance(seen, dict) else seen) == 3
        actions = envs.action_space.sample()
        if name == "NumpyToTorch":
            import torch

            actions = torch.as_tensor(actions)
        seen, rewards, *_ = envs.step(actions)
        assert np.isfinite(np.asarray(rewards)).all()
    envs.close()


@pytest.mark.parametrize("how", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_gymnasiums_own_vectors_see_what_ours_sees(how):
    """Single environments in Gymnasium's vectors swim as the batch does, through ends too."""
    theirs = how([lambda: gym.make(ENV)] * 2)
    ours = gym.make_vec(ENV, 2)
    np.testing.assert_array_equal(theirs.reset(seed=5)[0], ours.reset(seed=5)[0])
    rng = np.random.default_rng(0)
    for _ in range(60):
        actions = rng.uniform(-1, 1, (2, 5)).astype(np.float32)
        for one, other in zip(theirs.step(actions)[:4], ours.step(actions)[:4], strict=True):
            np.testing.assert_array_equal(one, other)
    theirs.close()
    ours.close()


def _holds(space, seen) -> bool:
    seen = seen.numpy() if hasattr(seen, "numpy") else seen
    return seen in space
