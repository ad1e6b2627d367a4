"""Arrays on the device, and PyTorch tensors of the same memory."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import cuda

from fish_env.errors import MissingExtraError
from fish_env.gpu.target import SIMULATED


def zeros(shape: int | tuple[int, ...], dtype: Any) -> Any:
    """An array of zeros on the device."""
    return cuda.to_device(np.zeros(shape, dtype))


def put(values: npt.ArrayLike, dtype: Any) -> Any:
    """A copy of an array on the device."""
    return cuda.to_device(np.ascontiguousarray(values, dtype))


def fetch(array: Any) -> npt.NDArray[Any]:
    """A copy of a device array in the memory of the host."""
    copied: npt.NDArray[Any] = np.array(array.copy_to_host())
    return copied


def tensor(array: Any) -> Any:
    """A PyTorch tensor of the memory of a device array: nothing is copied.

    Raises:
        MissingExtraError: PyTorch is not installed.
    """
    try:
        import torch
    except ImportError as error:
        raise MissingExtraError(
            "tensors need PyTorch: pip install torch, in a build for your GPU (see docs/gpu.md)"
        ) from error
    if SIMULATED:
        return torch.from_numpy(array._ary)
    return torch.as_tensor(array, device="cuda")


def wait() -> None:
    """Wait until the device has done all that it was told."""
    synchronise: Callable[[], None] = cuda.synchronize
    synchronise()


def available() -> bool:
    """Whether there is a device, be it simulated, and what compiles for it."""
    found: Callable[[], bool] = cuda.is_available
    return SIMULATED or (find_spec("numba_cuda") is not None and found())


def current_stream() -> Any:
    """The stream on which PyTorch works at present, so that kernels are ordered with its own."""
    if SIMULATED:
        return 0
    import torch

    handle = torch.cuda.current_stream().cuda_stream
    return cuda.external_stream(handle) if handle else 0
