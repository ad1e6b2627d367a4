"""Weights of eight bits: a quarter of the memory, with small errors in the actions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from robofish_agents.policies.files import PolicyFile

Float32Array = npt.NDArray[np.float32]
LARGEST = 127


def quantise(weight: Float32Array) -> tuple[npt.NDArray[np.int8], Float32Array]:
    """Rounds a weight matrix to eight bits, with a scale for each output.

    Args:
        weight: (outputs, inputs).

    Returns:
        Whole numbers in -127..127 (outputs, inputs), and scales (outputs,); their product is
        nearest to the weights.
    """
    largest = np.max(np.abs(weight), axis=1)
    scale = np.where(largest > 0.0, largest / LARGEST, 1.0).astype(np.float32)
    return np.rint(weight / scale[:, None]).astype(np.int8), scale


def with_int8_weights(policy: PolicyFile) -> PolicyFile:
    """Returns the policy that the C header with weights of eight bits computes.

    Use it to measure the effect of rounding before the policy is on a robot.

    Args:
        policy: the policy as it was trained.

    Returns:
        The same policy with rounded weights.
    """
    rounded = []
    for weight in policy.network.weights:
        whole, scale = quantise(weight)
        rounded.append((whole * scale[:, None]).astype(np.float32))
    return replace(policy, network=replace(policy.network, weights=tuple(rounded)))
