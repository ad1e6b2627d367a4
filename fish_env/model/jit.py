"""The only place that decorates kernels, and what names the folder of their machine code.

numba's cache does not notice an edited callee in another file (numba issue 1833). Every kernel
source therefore enters the hash that names the cache folder: an edit of any of them starts a fresh
one, and an edit of a file that no kernel draws on compiles nothing anew.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Iterable, Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.registry import CPUDispatcher

from fish_env.model.kernel_cache import cache_root, keep_machine_code

F = TypeVar("F", bound=Callable[..., Any])
PACKAGE = Path(__file__).resolve().parent.parent
PHYSICS = (PACKAGE / "model", PACKAGE / "effects")
RECORD = PACKAGE / "params" / "packing.py"
"""Says which row of a record holds which parameter."""

# IEEE semantics on purpose (no fastmath): one lane or sixteen then give the same bits.
_COMMON: dict[str, Any] = {"error_model": "numpy", "nogil": True}
# Nothing calls these functions through a pointer of C.
_ENTRY: dict[str, Any] = {**_COMMON, "no_cfunc_wrapper": True}
_COUNTLESS: dict[str, Any] = {**_ENTRY, "_nrt": False}
_CALLED: dict[str, Any] = {**_ENTRY, "no_cpython_wrapper": True}
_INLINED: dict[str, Any] = {**_CALLED, "forceinline": True}
# They make no arrays. Counting references to those they are given takes a twentieth of the time.
_SHARED: dict[str, Any] = {**_CALLED, "_nrt": False}


class InnerKernel(CPUDispatcher):
    """A compiled function without the wrapper through which Python calls it.

    Only kernels call kernels as a rule, and their wrappers, which take named tuples apart, are a
    fifth of the time to compile a composed model.
    """

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call it from Python: compiled once more, since a call without a wrapper would crash."""
        return self._wrapped(*args, **named)

    @cached_property
    def _wrapped(self) -> Callable[..., Any]:
        compile_: Callable[[Any], Callable[..., Any]] = numba.njit(**_COMMON)
        return compile_(self.py_func)


def kernel(function: F) -> F:
    """Compile a physics function that is always inlined into the kernel calling it.

    Kernels take and return floats, arrays and named tuples of floats: no random numbers, no I/O,
    no exceptions. Effects written by users carry the same decorator.
    """
    return _within(function, _INLINED)


def shared_kernel(function: F) -> F:
    """As :func:`kernel`, for a large one that is called and not inlined.

    What several places call is then compiled once for all of them. Nothing is known in it of the
    numbers that it is called with.
    """
    return _within(function, _SHARED)


def _within(function: F, options: dict[str, Any]) -> F:
    """A function that only kernels call."""
    compiled: Any = numba.njit(**options)(function)
    if not hasattr(compiled, "targetoptions"):  # NUMBA_DISABLE_JIT
        return function
    return cast(F, InnerKernel(function, targetoptions=compiled.targetoptions))


def entry_point(function: F) -> F:
    """Compile a function that Python calls; its machine code is kept on disk."""
    return _kept(function, _ENTRY)


def entry_point_of_file(function: F) -> F:
    """As :func:`entry_point`, for a function of an ordinary module, which no composition holds.

    Its machine code is kept in a folder named by its file and all that this imports.
    """
    file = Path(py_function(function).__code__.co_filename)
    return _kept(function, _ENTRY, cache_root() / _hash(sources_behind(file), ()))


def lean_entry_point(function: F) -> F:
    """As :func:`entry_point`, for one that makes no arrays, nor does any kernel it calls.

    It then need not count references to the arrays it is given, half a microsecond a call.
    """
    return _kept(function, _COUNTLESS)


def _kept(function: F, options: dict[str, Any], folder: Path | None = None) -> F:
    compile_: Callable[[F], F] = numba.njit(**options)
    compiled = compile_(function)
    keep_machine_code(compiled, folder)
    return compiled


def py_function(function: Callable[..., Any]) -> Callable[..., Any]:
    """The plain Python function behind a compiled one."""
    return getattr(function, "py_func", function)


def fingerprint(value: Any) -> str:
    """What a kernel's machine code depends on, as text: its code and all that this refers to."""
    function = py_function(value)
    code = getattr(function, "__code__", None)
    if code is None:
        return repr(value)
    names = [name for name in code.co_names if name in function.__globals__]
    used = [fingerprint(function.__globals__[name]) for name in names]
    enclosed = [fingerprint(cell.cell_contents) for cell in function.__closure__ or ()]
    return repr((code.co_code, code.co_consts, code.co_names, used, enclosed))


def source_hash(extra_sources: Iterable[Path] = (), texts: Iterable[str] = ()) -> str:
    """Hash of every kernel source of the physics (``model/``, ``effects/``), files and texts."""
    files = [path for folder in PHYSICS for path in sorted(folder.glob("*.py"))]
    return _hash((*files, RECORD, *extra_sources), texts)


@cache
def sources_behind(template: Path) -> tuple[Path, ...]:
    """A template and the files of this package that it draws on, beside those of the physics."""
    found: list[Path] = []
    waiting = [template]
    while waiting:
        file = waiting.pop()
        if file not in found and file.parent not in PHYSICS:
            found.append(file)
            waiting += _imported(file)
    return tuple(sorted(found))


def _imported(file: Path) -> Iterator[Path]:
    """Files of this package that a source imports when it is loaded."""
    for node in ast.parse(file.read_bytes()).body:
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        for name in names:
            module = PACKAGE.parent.joinpath(*name.split("."))
            if PACKAGE in module.parents:
                yield from filter(Path.is_file, (module.with_suffix(".py"), module / "__init__.py"))


def _hash(files: Iterable[Path], texts: Iterable[str]) -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in files:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    for text in texts:
        digest.update(text.encode())
    return digest.hexdigest()[:16]
