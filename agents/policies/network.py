"""The forward pass of a policy in NumPy: normalise, layers, action."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray

Float32Array = npt.NDArray[np.float32]


def _relu(values: Float32Array) -> Float32Array:
    return np.maximum(values, np.float32(0.0))


ACTIVATIONS: dict[str, Callable[[Float32Array], Float32Array]] = {"tanh": np.tanh, "relu": _relu}
"""Between layers."""
OUTPUTS: dict[str, Callable[[Float32Array], Float32Array]] = {
    "clip": lambda values: np.clip(values, np.float32(-1.0), np.float32(1.0)),
    "tanh": np.tanh,
}
"""From the last layer to actions in [-1, 1]: PPO clips, SAC squashes."""


@dataclass(frozen=True, eq=False)
class Network:
    """A multi-layer perceptron behind a fixed normalisation.

    Attributes:
        mean: (n,) subtracted from what the policy sees.
        scale: (n,) what the difference is divided by.
        limit: normalised values are clipped to this.
        weights: float32 matrices (outputs, inputs), layer after layer.
        biases: float32 vectors (outputs,).
        activation: key of ACTIVATIONS.
        output: key of OUTPUTS.
    """

    mean: FloatArray
    scale: FloatArray
    limit: float
    weights: tuple[Float32Array, ...]
    biases: tuple[Float32Array, ...]
    activation: str
    output: str

    def __call__(self, seen: Float32Array) -> Float32Array:
        """Mean actions (N, 5) in [-1, 1] for what the policy sees (N, n)."""
        normal = np.clip((seen - self.mean) / self.scale, -self.limit, self.limit)
        values = normal.astype(np.float32)
        between = ACTIVATIONS[self.activation]
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = values @ weight.T + bias
            if layer < last:
                values = between(values)
        return np.asarray(OUTPUTS[self.output](values), np.float32)
