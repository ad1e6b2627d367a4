"""The second back end: compiles the kernels of the physics, unchanged, as CUDA device functions.

A kernel is an ordinary Python function behind its decorator. Its bytecode is taken as it is; the
numbers in it get the type of the target, and the kernels that it calls become device functions in
turn. Without that, every literal would be a float64 and turn float32 arithmetic into float64.
"""

from __future__ import annotations

import math
import types
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numba import cuda
from numba.core import config
from numba.core.dispatcher import Dispatcher

from fish_env.model.jit import py_function

SIMULATED = bool(vars(config)["ENABLE_CUDASIM"])
"""Whether CUDA is simulated in Python (``NUMBA_ENABLE_CUDASIM=1``), for tests without a GPU."""


class Target:
    """Device functions for one type of numbers.

    Attributes:
        real: ``numpy.float32`` or ``numpy.float64``: the type of every number on the device.
    """

    def __init__(
        self,
        real: type[Any],
        replacements: Mapping[Any, Any] | None = None,
        scope: Mapping[str, Any] | None = None,
    ) -> None:
        """Prepare a target; nothing is compiled yet.

        Args:
            real: type of the numbers.
            replacements: kernel -> function that stands for it on this target.
            scope: global names of functions that their own modules do not define.
        """
        self.real = real
        self._replacements = {
            py_function(kernel): py_function(other)
            for kernel, other in (replacements or {}).items()
        }
        self._scope = dict(scope or {})
        self._made: dict[Any, Any] = {}
        self._numpy = _numpy_for(real)

    def device(self, kernel: Any) -> Any:
        """The device function that computes what a kernel computes."""
        function = py_function(kernel)
        if function not in self._made:
            own = self._retyped(self._replacements.get(function, function))
            options = {} if SIMULATED else {"forceinline": True}
            self._made[function] = self._compile(own, device=True, **options)
        return self._made[function]

    def launched(self, function: Callable[..., None], **options: Any) -> Any:
        """A CUDA kernel of a function that calls device functions.

        Args:
            function: what one thread does.
            **options: of ``numba.cuda.jit``; the simulator takes none.
        """
        return self._compile(self._retyped(function), **({} if SIMULATED else options))

    def _compile(self, function: Callable[..., Any], **options: Any) -> Any:
        decorate: Callable[..., Any] = cuda.jit
        return decorate(**options)(function)

    def _retyped(self, function: Any) -> Any:
        """A copy of a function with numbers of this target, which calls device functions."""
        code: types.CodeType = function.__code__
        known = self._scope | function.__globals__
        scope = {name: self._value(known[name]) for name in code.co_names if name in known}
        cells = function.__closure__ or ()
        return types.FunctionType(
            code.replace(co_consts=tuple(map(self._constant, code.co_consts))),
            scope | {"__builtins__": __builtins__, "__name__": function.__module__},
            function.__name__,
            function.__defaults__,
            tuple(types.CellType(self._value(cell.cell_contents)) for cell in cells),
        )

    def _constant(self, constant: Any) -> Any:
        return self._value(constant) if isinstance(constant, (float, tuple)) else constant

    def _value(self, value: Any) -> Any:
        """What stands for a global value of a kernel on this target."""
        if isinstance(value, (Dispatcher, types.FunctionType)):
            return self.device(value)
        if isinstance(value, float):
            return self.real(value)
        if type(value) is tuple:
            return tuple(map(self._value, value))
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            return value.astype(self.real)
        return self._numpy if value is np else value


def _numpy_for(real: type[Any]) -> types.ModuleType:
    """NumPy as kernels see it, whose infinity is a number of the target too."""
    module = types.ModuleType("numpy_on_device")
    # What casts to float64 on the CPU, casts to the type of the target on the device.
    vars(module).update(
        inf=real(np.inf),
        sqrt=math.sqrt,
        float32=np.float32,
        float64=real,
        int32=np.int32,
        uint64=np.uint64,
    )
    return module
