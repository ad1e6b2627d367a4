"""What a GPU does again and again, recorded once and replayed.

A training of small networks launches many small kernels, and Python takes longer to launch them
than the GPU to compute them. A CUDA graph launches all of them at once.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

import torch
from torch import Tensor, nn

Result = TypeVar("Result")


@contextmanager
def _no_garbage() -> Iterator[None]:
    """Frees what is unused now, and nothing within: memory freed would spoil a record."""
    gc.collect()
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


class Replayed(Generic[Result]):
    """Calls a function; on a GPU, its launches are recorded in the second call, and replayed.

    The first call is a usual one: it compiles what has to be compiled. Later calls return the
    tensors of the second one, with new numbers in them.
    """

    def __init__(self, function: Callable[[], Result], on_gpu: bool) -> None:
        """Call nothing yet.

        Args:
            function: reads and writes the same tensors in every call, and does not wait for the
                GPU. Tensors that it makes are the same ones in every call that is replayed.
            on_gpu: whether it computes on a GPU; otherwise all calls are usual ones.
        """
        self._function, self._on_gpu = function, on_gpu
        self._calls = 0
        self._graph: Any = None
        self._result: Result | None = None

    def __call__(self) -> Result:
        """Call or replay the function."""
        self._calls += 1
        if not self._on_gpu or self._calls == 1:
            return self._function()
        if self._result is None:
            self._result = self._record()
        self._graph.replay()
        return self._result

    def _record(self) -> Result:
        """Record what the function launches; nothing is computed."""
        self._graph = torch.cuda.CUDAGraph()
        with _no_garbage(), torch.cuda.graph(self._graph, capture_error_mode="relaxed"):
            return self._function()


class _Function(nn.Module):
    """A function of tensors, and the module whose parameters it reads."""

    def __init__(self, module: nn.Module, function: Callable[..., tuple[Tensor, ...]]) -> None:
        super().__init__()
        self.module, self._function = module, function

    def forward(self, *given: Tensor) -> tuple[Tensor, ...]:
        return self._function(*given)


def differentiable(
    module: nn.Module, function: Callable[..., tuple[Tensor, ...]], like: tuple[Tensor, ...]
) -> Callable[..., tuple[Tensor, ...]]:
    """A function of tensors whose values and gradients a GPU replays; on the CPU itself.

    Args:
        module: holds the parameters that the function reads.
        function: does not wait for the GPU.
        like: tensors with the shapes, types and device of what it will be given.
    """
    if not like[0].is_cuda:
        return function
    examples = tuple(torch.zeros_like(tensor) for tensor in like)
    with _no_garbage():
        replayed: Any = torch.cuda.make_graphed_callables(_Function(module, function), examples)
    return lambda *given: replayed(*given)
