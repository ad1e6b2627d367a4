"""Find the effects: one module of this package each, and files of users."""

from __future__ import annotations

import copyreg
import difflib
import hashlib
import importlib
import importlib.util
import pkgutil
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

from fish_env.errors import EffectError
from fish_env.model.effect import SECTIONS, Effect

_NOT_EFFECTS = {"registry", "extended", "kinds"}


@cache
def catalogue() -> dict[str, Effect]:
    """All shipped effects by name, in the order of their sections, then ``order``, then name.

    This order is also the order in which their hooks run.
    """
    package = importlib.import_module("fish_env.effects")
    names = [m.name for m in pkgutil.iter_modules(package.__path__) if m.name not in _NOT_EFFECTS]
    found = [importlib.import_module(f"fish_env.effects.{name}").EFFECT for name in names]
    found.sort(key=lambda effect: (SECTIONS.index(effect.section), effect.order, effect.name))
    return {effect.name: effect for effect in found}


def get_effect(name: str) -> Effect:
    """The shipped effect of this name.

    Raises:
        EffectError: no such effect; the message suggests the nearest name.
    """
    effects = catalogue()
    if name in effects:
        return effects[name]
    near = difflib.get_close_matches(name, effects, 1)
    hint = f"did you mean '{near[0]}'?" if near else f"known effects: {', '.join(effects)}"
    raise EffectError(f"unknown effect '{name}': {hint}")


def load_effect_file(path: str | Path) -> Effect:
    """An effect from a user's own Python file, which defines ``EFFECT`` (see model.effect).

    Raises:
        EffectError: the file is missing, fails to run, or defines no ``EFFECT``.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise EffectError(f"{file}: no such effect file")
    digest = hashlib.sha256(file.read_bytes()).hexdigest()[:12]
    name = f"robofish_user_effect_{digest}"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, file)
        if spec is None or spec.loader is None:
            raise EffectError(f"{file}: not a Python file, its name must end in .py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]
            raise EffectError(f"{file}: running the effect file failed: {error}") from error
    effect = getattr(sys.modules[name], "EFFECT", None)
    if not isinstance(effect, Effect):
        raise EffectError(f"{file}: define EFFECT = fish_env.model.effect.Effect(...)")
    if effect.name in catalogue():
        raise EffectError(f"{file}: the name '{effect.name}' is taken by a shipped effect")
    return replace(effect, file=file)


def _restore(name: str, file: Path | None) -> Effect:
    return get_effect(name) if file is None else load_effect_file(file)


def _reduce(effect: Effect) -> tuple[Callable[..., Effect], tuple[str, Path | None]]:
    return _restore, (effect.name, effect.file)


# Compiled hooks cannot be pickled, so an effect travels by name, or by its file.
copyreg.pickle(Effect, _reduce)
