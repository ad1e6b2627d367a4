"""Compose baseline and effects into one source text, and compile it.

The text is written to a cache folder and imported from there, so a composed model is ordinary
code: it can be read, stepped through, run without numba, and numba caches its machine code.
"""

from __future__ import annotations

import importlib.util
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from types import ModuleType

from fish_env.errors import OutputError
from fish_env.files import write_text
from fish_env.model import jit
from fish_env.model.composition import Composition
from fish_env.model.effect import STAGES, Effect
from fish_env.model.emit import HEADER
from fish_env.model.emit_corners import CornerEmitter
from fish_env.model.kernel_cache import cache_root

_BEGIN = "# --- completed by compose ---"
_END = "# --- end ---"


def _kept_imports(template: str) -> str:
    """The template's own imports: what stands between ``import numpy`` and the marked part."""
    before = template[: template.index(_BEGIN)]
    return before[before.index("import numpy as np") :]


def source(composition: Composition) -> str:
    """The composed module as text."""
    texts = [path.read_text(encoding="utf-8") for path in composition.templates]
    bodies = [text[text.index(_END) :] for text in texts]
    imports = [_kept_imports(text) for text in texts]
    return "\n".join([HEADER, *imports, CornerEmitter(composition).text(), *bodies])


def cache_folder(composition: Composition) -> Path:
    """Where a composed module is kept; another folder after an edit of anything it draws on."""
    files = [effect.file for effect in composition.effects if effect.file is not None]
    for template in composition.templates:
        files += jit.sources_behind(template)
    # An effect made in Python has no file to tell one version from the next: its code does.
    codes = [
        jit.fingerprint(hook)
        for effect in composition.effects
        if effect.file is None
        for hook in (
            *effect.hooks.values(), effect.initial_states, effect.turns, effect.corner,
            effect.settling, effect.part,
        )  # fmt: skip
    ]
    return cache_root() / jit.source_hash(files, codes)


def load(composition: Composition) -> ModuleType:
    """Import the composed module, writing it to the cache folder first if it is new."""
    folder = cache_folder(composition)
    name = f"robofish_composed_{composition.label}_{folder.name}"
    if name in sys.modules:
        return sys.modules[name]
    path, text = folder / f"{composition.label}.py", source(composition)
    kept = _kept(path, text)
    try:
        module = _executed(composition, name, path, None if kept else text)
    except (EOFError, ValueError, TypeError):  # a damaged bytecode file; the source is as it should
        Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)
        module = _executed(composition, name, path, None if kept else text)
    return module


def _kept(path: Path, source: str) -> bool:
    """Whether the source stands in its file; it is put there if it is missing or damaged."""
    with suppress(OSError, UnicodeDecodeError):
        if path.read_text(encoding="utf-8") == source:
            return True
    try:
        write_text(path, source)
    except OutputError as error:
        warnings.warn(f"{error}; the kernels are compiled for this process alone", stacklevel=2)
        return False
    return True


def _executed(composition: Composition, name: str, path: Path, source: str | None) -> ModuleType:
    """The module of a file, or of a text that stands for it."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    for effect in composition.effects:
        _inject(module, effect)
    sys.modules[name] = module
    try:
        if source is None:
            spec.loader.exec_module(module)
        else:
            exec(compile(source, str(path), "exec"), vars(module))
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _inject(module: ModuleType, effect: Effect) -> None:
    """Give the module the effect's kernels by name."""
    setattr(module, f"{effect.name}_record", effect.record_type)
    for stage in STAGES:
        if stage in effect.hooks:
            setattr(module, f"{effect.name}_{stage}", effect.hooks[stage])
    for ending, kernel in (
        ("initial", effect.initial_states),
        ("turns", effect.turns),
        ("corner", effect.corner),
        ("settling", effect.settling),
        ("part", effect.part),
    ):
        if kernel is not None:
            setattr(module, f"{effect.name}_{ending}", kernel)
