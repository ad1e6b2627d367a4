"""Checks of single properties, each a function, so that broken environments can be tried too.

Every checker takes a function that makes the environment and raises AssertionError.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

from fish_env.envs.layout import OBSERVATION
from fish_env.envs.registration import ENV_ID
from fish_env.model.state import INPUTS
from fish_env.simulator import InitialState, Simulator
from tests.conformance.cases import IDEAL, REST_ACTION, START, STEADY, random_actions, run
from tests.conformance.reference_observation import Observer

Make = Callable[..., Any]


def fingerprint(env: gym.Env, seed: int | None, steps: int = 60) -> str:
    """Hash of all bits of an episode."""
    obs, rewards, infos = run(env, random_actions(steps), seed)
    text = obs.tobytes() + rewards.tobytes() + repr(infos).encode()
    return hashlib.sha256(text).hexdigest()


def check_determinism(make: Make) -> None:
    """A seed decides everything, including episodes that follow without a seed."""
    first, second = make(), make()
    prints = [(fingerprint(env, 5), fingerprint(env, None)) for env in (first, second, first)]
    assert prints[0] == prints[1], "another environment with the same seed goes another way"
    assert prints[0] == prints[2], "the same environment with the same seed goes another way"
    assert prints[0][0] != prints[0][1], "episodes repeat"
    assert fingerprint(first, 6) != prints[0][0], "the seed changes nothing"


def check_observations(make: Make, steps: int = 300) -> None:
    """Finite and inside the space, from reset on and through every end of an episode."""
    env = make()
    space = env.observation_space
    obs, _ = env.reset(seed=0)
    for action in random_actions(steps, seed=3):
        assert np.all(np.isfinite(obs)), "an observation is not finite"
        assert np.all((obs >= space.low) & (obs <= space.high)), "an observation is clipped wrong"
        obs, reward, terminated, _, _ = env.step(action)
        assert np.isfinite(reward)
        if terminated:
            obs, _ = env.reset()


def _same(name: str, ours: Any, theirs: Any) -> None:
    """Two vector infos (or parts of them) hold the same, to the last bit."""
    if isinstance(theirs, dict):
        assert isinstance(ours, dict), f"{name} is not a mapping"
        assert ours.keys() == theirs.keys(), f"{name}: {set(ours) ^ set(theirs)}"
        for key, value in theirs.items():
            _same(f"{name}[{key!r}]", ours[key], value)
    elif theirs.dtype == object:
        for mine, other in zip(ours, theirs, strict=True):
            assert (mine is None) == (other is None), f"{name}: missing or too many"
            assert mine is None or mine.tobytes() == other.tobytes(), f"{name} differs"
    else:
        assert ours.dtype == theirs.dtype, f"{name}: {ours.dtype} is not {theirs.dtype}"
        assert ours.tobytes() == theirs.tobytes(), f"{name} differs"


def check_vector(
    make: Make,
    count: int,
    mode: gym.vector.AutoresetMode,
    options: dict[str, Any],
    steps: int = 60,
    limit: int = 25,
    seed: Any = 4,
) -> tuple[int, int]:
    """A native batch equals Gymnasium's own vector of single environments, bit for bit.

    Observations, rewards, ends, infos with their masks, final observations and final infos.

    Returns:
        How many episodes were terminated, and how many truncated.
    """
    ours = make(count, max_episode_steps=limit, autoreset_mode=mode, **options)
    theirs = gym.make_vec(
        ENV_ID,
        num_envs=count,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        max_episode_steps=limit,
        disable_env_checker=True,
        **options,
    )
    return compare_vectors(ours, theirs, random_actions(steps, lanes=count), mode, seed)


def compare_vectors(ours: Any, theirs: Any, actions: Any, mode: Any, seed: Any) -> tuple[int, int]:
    """Step both with the same actions, resetting ended fish where the mode leaves that to us."""
    ends = np.zeros(2, int)
    (obs, infos), (other, other_infos) = ours.reset(seed=seed), theirs.reset(seed=seed)
    assert obs.tobytes() == other.tobytes(), "first observations differ"
    _same("infos", infos, other_infos)
    for row in actions:
        obs, reward, terminated, truncated, infos = ours.step(row)
        other, other_reward, other_terminated, other_truncated, other_infos = theirs.step(row)
        assert obs.tobytes() == other.tobytes(), "observations differ"
        assert reward.tobytes() == other_reward.tobytes(), "rewards differ"
        assert terminated.tobytes() == other_terminated.tobytes(), "terminations differ"
        # TimeLimit says both at the last step; a fish that fails there has failed, no more.
        other_truncated &= ~other_terminated
        assert truncated.tobytes() == other_truncated.tobytes(), "truncations differ"
        _same("infos", infos, other_infos)
        ended = terminated | truncated
        ends += terminated.sum(), truncated.sum()
        if mode is gym.vector.AutoresetMode.DISABLED and ended.any():
            (obs, infos), (other, other_infos) = (
                env.reset(options={"reset_mask": ended.copy()}) for env in (ours, theirs)
            )
            assert obs.tobytes() == other.tobytes(), "observations after a masked reset differ"
            _same("infos", infos, other_infos)
    return int(ends[0]), int(ends[1])


def check_observation_values(make: Make, goal: dict[str, float], delay_steps: int = 0) -> None:
    """Every observation is what its row of the table says, and info the truth, at each step.

    The environment must run one physics step per control step, so that its history is known.
    """
    env = make()
    obs, _ = env.reset(seed=2, options={"goal": goal})
    observer = Observer(env, goal, delay_steps)
    _close(obs, observer.expected(REST_ACTION), "reset")
    for step, action in enumerate(np.repeat(random_actions(25, seed=9), 10, axis=0)):
        obs, _, _, _, info = env.step(action)
        observer.watch()
        _close(obs, observer.expected(action), f"step {step}")
        for name, value in observer.truth().items():
            assert np.isclose(info[name], value, rtol=0, atol=1e-9), f"step {step}: info {name}"


def _close(obs: np.ndarray, expected: np.ndarray, when: str) -> None:
    wrong = np.flatnonzero(np.abs(obs - expected) > 2e-6 * (1 + np.abs(expected)))
    names = [f"{i} ({OBSERVATION[i][0]}): {obs[i]} for {expected[i]}" for i in wrong]
    assert not names, f"{when}: {'; '.join(names)}"


SENSED = [0, 1, *range(3, 8), 9, *range(11, 21)]
"""Observations that come from sensors, with a constant goal."""


def check_observation_delay(make: Make, delay: float) -> None:
    """What a delayed environment shows is what an undelayed one showed that long ago.

    The undelayed one runs a control step per physics step, with the same actions held.
    """
    actions = np.repeat(random_actions(8, seed=1), 5, axis=0)
    actions[:, 2] = 0.5  # one beat frequency, so that means are over the same window
    late, *_ = run(make(config=IDEAL, observation_delay_s=delay), actions, 3, goal=STEADY)
    fine = make(config=IDEAL, control_hz=100.0)
    now, *_ = run(fine, np.repeat(actions, 10, axis=0), 3, goal=STEADY)
    steps = round(delay * 100)
    for step in range(1 + steps // 10, len(late)):
        seen, shown = late[step, SENSED], now[10 * step - steps, SENSED]
        assert seen.tobytes() == shown.tobytes(), f"step {step}: {seen - shown}"
    commands = np.arange(21, 33)
    assert late[10, commands].tobytes() == now[100, commands].tobytes()


def check_slew(make: Make) -> None:
    """Every actuator moves towards its target by at most slew x period, and stops there."""
    env = make()
    config = env.options.config
    env.reset(seed=0, options=START)
    before = env.actuators
    for action in np.repeat(random_actions(12, seed=5), 4, axis=0):
        env.step(action)
        target = config.low + (np.clip(action, -1, 1).astype(float) + 1) / 2 * (
            config.high - config.low
        )
        limit = config.slew * config.control_period
        expected = before + np.clip(target - before, -limit, limit)
        assert np.allclose(env.actuators, expected, rtol=0, atol=1e-14), "ramps are not exact"
        before = env.actuators


def _schedule(env: Any, actions: np.ndarray, delay: float = 0.0) -> list[dict[str, float]]:
    """The simulator's schedule for actions of ideal actuators that arrive late."""
    config = env.options.config
    rows = [{"t": 0.0, **dict(zip(INPUTS, np.clip(0.0, config.low, config.high), strict=True))}]
    for i, action in enumerate(actions.astype(float)):
        values = config.low + (np.clip(action, -1, 1) + 1) / 2 * (config.high - config.low)
        rows.append(
            {"t": i * config.control_period + delay, **dict(zip(INPUTS, values, strict=True))}
        )
    return rows[1:] if delay == 0 else rows


def check_physics(make: Make, options: dict[str, Any], delay: float = 0.0) -> None:
    """States after each control step equal the simulator's to 1e-12."""
    given = {"action_delay_s": delay} if delay else {}
    env = make(config={**IDEAL, "tank": {"depth": 4.0}}, **options, **given)
    actions = random_actions(30, seed=7)
    actions[0] = REST_ACTION  # the simulator's servo starts at its first command
    start = InitialState(
        (0.0, 0.0, 2.0), (0.1, -0.2, 1.0), (0.05, 0.01, 0.0), (0.1, 0.2, -0.1), 0.4
    )
    env.reset(options={"state": vars(start)})
    states = []
    for action in actions:
        env.step(action)
        states.append(list(env.state.values()))
    water = {name: dict(env.options.model.effects[name]) for name in env.options.model.effects}
    expected = Simulator(env.options.model.fish, env.options.config.dt, water).run(
        _schedule(env, actions, delay), duration_s=3.0, initial=start
    )
    off = np.abs(np.array(states) - expected.states[1:]).max(axis=1)
    assert off.max() < 1e-12, f"off by {off.max()} from step {np.argmax(off > 1e-12)} on"


def check_action_delay(make: Make, delay: float) -> None:
    """Actions act exactly ``delay`` later."""
    check_physics(make, {}, delay)


def check_reward(make: Make) -> None:
    """Bounded; the sum of its terms; each term as the class docstring says."""
    env = make()
    tree = env.options.config.tree["reward"]
    actions = random_actions(150, seed=8)
    _, rewards, infos = run(env, actions)
    last = (np.clip(0.0, env.options.config.low, env.options.config.high) - _middle(env)) / _half(
        env
    )
    for action, reward, info in zip(actions, rewards, infos[1:], strict=True):
        action = np.clip(action.astype(float), -1, 1)
        weights, margins = tree["weights"] | tree.get(env.options.task, {}), tree["margins"]
        away = info["place_error"] or info["cross_track_error"]
        place = weights.get("place", 0.0) / (1 + (away / weights.get("margin", 1.0)) ** 2)
        assert np.isclose(info["reward_place"], place, atol=1e-12), "place"
        for name in ("depth", "heading", "speed"):
            shape = 1 / (1 + (info[f"{name}_error"] / margins[name]) ** 2)
            assert np.isclose(info[f"reward_{name}"], weights[name] * shape, atol=1e-12), name
        share = info["power"] / (info["power"] + tree["power_scale"])
        assert np.isclose(info["cost_power"], weights["power"] * share, atol=1e-12), "power"
        change = np.mean((action - last) ** 2) / 4
        assert np.isclose(info["cost_action"], weights["action"] * change, atol=1e-12), "action"
        gains = sum(info[f"reward_{name}"] for name in ("depth", "heading", "speed", "place"))
        total = gains - info["cost_power"] - info["cost_action"]
        assert abs(reward - total) < 1e-15, "the reward is not the sum of its terms"
        assert -0.1 <= reward <= 1.0
        last = action


def _middle(env: Any) -> np.ndarray:
    return (env.options.config.low + env.options.config.high) / 2


def _half(env: Any) -> np.ndarray:
    return (env.options.config.high - env.options.config.low) / 2
