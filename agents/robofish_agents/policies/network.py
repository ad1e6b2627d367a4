"""The forward pass of a policy in NumPy: normalise, layers, action."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fish_env.arrays import FloatArray

Float32Array = npt.NDArray[np.float32]


def _relu(values: FloatArray) -> FloatArray:
    return np.maximum(values, 0.0)


ACTIVATIONS: dict[str, Callable[[FloatArray], FloatArray]] = {"tanh": np.tanh, "relu": _relu}
"""Between layers."""
OUTPUTS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "clip": lambda values: np.clip(values, -1.0, 1.0),
    "tanh": np.tanh,
}
"""From the last layer to actions in [-1, 1]: PPO clips, SAC squashes."""


@dataclass(frozen=True, eq=False)
class Network:
    """A multi-layer perceptron behind a fixed normalisation.

    It computes in double precision. Sums of single precision would depend on the linear algebra
    library and on the number of rows, by up to 3e-6 in an action.

    Attributes:
        mean: (n,) subtracted from the inputs.
        scale: (n,) divisor of the difference.
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
        """Returns mean actions (N, 5) in [-1, 1] for inputs of the policy (N, n)."""
        values = np.clip((seen - self.mean) / self.scale, -self.limit, self.limit)
        between = ACTIVATIONS[self.activation]
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self._matrices, self.biases, strict=True)):
            values = values @ weight + bias
            if layer < last:
                values = between(values)
        return np.asarray(OUTPUTS[self.output](values), np.float32)

    @cached_property
    def _matrices(self) -> tuple[FloatArray, ...]:
        """The weights as matrices (inputs, outputs) of double precision."""
        return tuple(np.ascontiguousarray(weight.T, float) for weight in self.weights)
