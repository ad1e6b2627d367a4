"""The state of a learner of Stable-Baselines3 as plain values, to resume with the same bits."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.buffers import ReplayBuffer

from fish_env.reading import is_number, shown
from robofish_agents.training.forms import check_form, observations_of
from robofish_agents.training.model import Model

COUNTS = ("num_timesteps", "_n_updates", "_episode_num", "_current_progress_remaining")
LATEST = ("_last_obs", "_last_episode_starts", "_last_original_obs")
EPISODES = ("ep_info_buffer", "ep_success_buffer")
STORED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
MOMENTS = ("step", "exp_avg", "exp_avg_sq")
"""What Adam, the optimiser of every learner, keeps of a parameter."""
Plain = dict[str, Any]


def learner_state(model: Model) -> Plain:
    """Weights, optimisers, counters, latest observations, replay buffer, random generators."""
    entropy = _entropy(model)
    return {
        "weights": weights_state(model.policy.state_dict()),
        "optimisers": {name: optimiser_state(item) for name, item in _optimisers(model).items()},
        "entropy": None if entropy is None else entropy.detach().numpy(),
        "counts": {name: getattr(model, name) for name in COUNTS},
        "latest": {name: getattr(model, name) for name in LATEST},
        "episodes": {name: [*(getattr(model, name) or ())] for name in EPISODES},
        "replay": _replay(model.replay_buffer) if isinstance(model, SAC) else None,
        "actions": model.action_space.np_random.bit_generator.state,
        "random": random_state(),
    }


def restore_learner(model: Model, state: Plain) -> None:
    """Restores a learner of the same configuration; sets the global generators.

    Args:
        model: as :func:`robofish_agents.training.model.make_model` makes it.
        state: what :func:`learner_state` gave.

    Raises:
        KeyError, ValueError, RuntimeError: the state is not that of such a learner.
    """
    model.policy.load_state_dict(weights_tensors(state["weights"]))
    for name, optimiser in _optimisers(model).items():
        restore_optimiser(optimiser, state["optimisers"][name])
    _check_forms(model, state)
    entropy = _entropy(model)
    if entropy is not None:
        entropy.data.copy_(torch.as_tensor(state["entropy"]))
    for name in COUNTS:
        setattr(model, name, state["counts"][name])
    for name in LATEST:
        setattr(model, name, state["latest"][name])
    for name in EPISODES:
        setattr(model, name, deque(state["episodes"][name], maxlen=model._stats_window_size))
    if isinstance(model, SAC):
        _restore_replay(model.replay_buffer, state["replay"])
    model.action_space.np_random.bit_generator.state = state["actions"]
    restore_random(state["random"])


def _check_forms(model: Model, state: Plain) -> None:
    """Refuses a weight of entropy, counters, observations and episodes of another learner.

    Raises:
        ValueError: names what does not fit.
    """
    entropy = _entropy(model)
    check_form(state["entropy"], None if entropy is None else entropy.detach().numpy(), "entropy")
    check_form(state["counts"], {name: getattr(model, name) for name in COUNTS}, "counts")
    if any(value is not None for value in state["latest"].values()):
        seen = observations_of(model.observation_space, model.n_envs)
        latest = (seen, np.zeros(model.n_envs, bool), seen)
        check_form(state["latest"], dict(zip(LATEST, latest, strict=True)), "latest")
    for name, like in zip(EPISODES, ({"r": 0.0, "l": 0, "t": 0.0}, 0.0), strict=True):
        rows = state["episodes"][name]
        check_form(rows, [like] * len(rows), name)


def _optimisers(model: Model) -> dict[str, torch.optim.Optimizer]:
    if not isinstance(model, SAC):
        return {"policy": model.policy.optimizer}
    found = {"actor": model.actor.optimizer, "critic": model.critic.optimizer}
    if model.ent_coef_optimizer is not None:
        found["entropy"] = model.ent_coef_optimizer
    return found


def _entropy(model: Model) -> torch.Tensor | None:
    """Logarithm of the weight of entropy, where it is learnt."""
    if not isinstance(model, SAC) or model.ent_coef_optimizer is None:
        return None
    weight = model.log_ent_coef
    assert isinstance(weight, torch.Tensor)
    return weight


def optimiser_state(optimiser: torch.optim.Optimizer) -> Plain:
    """Moments and step sizes of an optimiser."""
    saved = optimiser.state_dict()
    return {
        "state": {str(key): weights_state(values) for key, values in saved["state"].items()},
        "rates": [group["lr"] for group in saved["param_groups"]],
    }


def restore_optimiser(optimiser: torch.optim.Optimizer, state: Plain) -> None:
    """Restores moments and step sizes.

    Args:
        optimiser: of the same parameters.
        state: what :func:`optimiser_state` gave.

    Raises:
        KeyError, ValueError: the state is not that of such an optimiser.
    """
    whole = optimiser.state_dict()
    whole["state"] = {int(key): weights_tensors(values) for key, values in state["state"].items()}
    _check_moments(optimiser, whole["state"])
    for group, rate in zip(whole["param_groups"], state["rates"], strict=True):
        if not is_number(rate) or rate < 0.0:
            raise ValueError(f"a step size of {shown(rate)}")
        group["lr"] = rate
    optimiser.load_state_dict(whole)


def _check_moments(optimiser: torch.optim.Optimizer, state: Mapping[int, Plain]) -> None:
    """Refuses moments that this optimiser cannot have, before it meets them in a step.

    Raises:
        ValueError: names the moment.
    """
    parameters = [one for group in optimiser.param_groups for one in group["params"]]
    for place, values in state.items():
        if not 0 <= place < len(parameters) or set(values) != set(MOMENTS):
            raise ValueError(f"moments {shown(list(values))} of parameter {shown(place)}")
        for name, value in values.items():
            like = torch.zeros(()) if name == "step" else parameters[place]
            fits = isinstance(value, torch.Tensor) and value.shape == like.shape
            if not fits or value.dtype != like.dtype:
                raise ValueError(f"moment {name} of parameter {place} does not fit")
            if name != "exp_avg" and bool((value < 0).any()):
                raise ValueError(f"moment {name} of parameter {place} is negative")


def _replay(buffer: ReplayBuffer | None) -> Plain:
    assert buffer is not None
    rows = buffer.buffer_size if buffer.full else buffer.pos
    stored = {name: getattr(buffer, name)[:rows] for name in STORED}
    return {"position": buffer.pos, "full": buffer.full, "stored": stored}


def _restore_replay(buffer: ReplayBuffer | None, state: Plain) -> None:
    assert buffer is not None
    place, full = state["position"], state["full"]
    check_form([place, full], [0, False], "replay")
    if not 0 <= place < buffer.buffer_size:
        raise ValueError(f"replay: a position of {shown(place)}")
    buffer.pos, buffer.full = place, full
    rows = buffer.buffer_size if full else place
    stored = {name: getattr(buffer, name)[:rows] for name in STORED}
    check_form(state["stored"], stored, "replay")
    for name, values in stored.items():
        values[:] = state["stored"][name]


def random_state() -> Plain:
    """The global generators of PyTorch, NumPy and Python."""
    kind, keys, position, has_gauss, gauss = np.random.get_state()  # noqa: NPY002
    return {
        "torch": torch.get_rng_state().numpy(),
        "numpy": {"keys": keys, "rest": [kind, position, has_gauss, gauss]},
        "python": random.getstate(),
    }


def restore_random(state: Plain) -> None:
    """Sets the global generators, see :func:`random_state`."""
    kind, *rest = state["numpy"]["rest"]
    torch.set_rng_state(torch.as_tensor(state["torch"]))
    np.random.set_state((kind, state["numpy"]["keys"], *rest))  # noqa: NPY002
    version, numbers, gauss = state["python"]
    random.setstate((version, tuple(numbers), gauss))


def weights_state(values: Mapping[str, Any]) -> Plain:
    """Tensors as arrays; other values as they are."""
    return {
        key: value.detach().cpu().numpy() if isinstance(value, torch.Tensor) else value
        for key, value in values.items()
    }


def weights_tensors(values: Mapping[str, Any]) -> Plain:
    """Arrays as tensors; other values as they are.

    Raises:
        ValueError: an array has numbers that are not finite.
    """
    for key, value in values.items():
        if isinstance(value, np.ndarray) and not np.all(np.isfinite(value)):
            raise ValueError(f"{shown(key)} is not finite")
    return {
        key: torch.from_numpy(np.array(value)) if isinstance(value, np.ndarray) else value
        for key, value in values.items()
    }
