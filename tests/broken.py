"""Models that are wrong on purpose, to show that the checkers notice.

A composed model is text, so a wrong one is that text with a replacement. It runs as plain Python,
without a compiler, and looks like any other :class:`~fish_env.simulator.Simulator`.
"""

from __future__ import annotations

import types
from collections.abc import Mapping
from typing import Any

from fish_env.model import compose
from fish_env.model.composition import Composition
from fish_env.model.runtime import Kernels
from fish_env.simulator import Simulator

JIT_IMPORT = "from fish_env.model.jit import entry_point, kernel, lean_entry_point, shared_kernel"
NO_JIT = "entry_point = lean_entry_point = kernel = shared_kernel = lambda function: function"
Replacements = Mapping[str, str]


def plain(value: Any, done: dict[Any, Any]) -> Any:
    """A compiled function as plain Python, all the way down; anything else unchanged."""
    function = getattr(value, "py_func", None)
    if function is None:
        return value
    if function not in done:
        namespace = dict(function.__globals__)
        done[function] = types.FunctionType(
            function.__code__, namespace, function.__name__, function.__defaults__
        )
        used = set(function.__code__.co_names) & set(namespace)
        namespace |= {name: plain(namespace[name], done) for name in used}
    return done[function]


def plain_module(composition: Composition, replacements: Replacements) -> types.ModuleType:
    """The composed module with texts replaced, as plain Python.

    Raises:
        LookupError: a text to replace is not there, so nothing would be broken.
    """
    text = compose.source(composition)
    for old, new in {**replacements, JIT_IMPORT: NO_JIT}.items():
        if old not in text:
            raise LookupError(f"the composed model no longer contains {old!r}")
        text = text.replace(old, new)
    module = types.ModuleType("broken_model")
    module.__file__ = __file__
    for effect in composition.effects:
        compose._inject(module, effect)
    exec(compile(text, "broken_model", "exec"), module.__dict__)
    done: dict[Any, Any] = {}
    module.__dict__.update({name: plain(value, done) for name, value in vars(module).items()})
    return module


class PlainKernels(Kernels):
    """Kernels of a composition as plain Python, with texts replaced."""

    def __init__(self, composition: Composition, replacements: Replacements) -> None:
        self.composition = composition
        self.module = plain_module(composition, replacements)
        self.state_names = composition.state_names
        self.parameter_names = composition.parameter_names
        self.lanes = self.module.LANES


def broken_simulator(replacements: Replacements, *args: Any, **options: Any) -> Simulator:
    """A simulator, arguments as for the real one, whose model has texts replaced."""
    simulator = Simulator(*args, **options)
    composition = Composition(simulator.model.declared, bool(simulator.fish.tables()))
    vars(simulator.model)["kernels"] = PlainKernels(composition, replacements)
    return simulator
