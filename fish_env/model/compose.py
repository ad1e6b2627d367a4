"""Compose baseline and effects into one source text, and compile it.

The text is written to a cache folder and imported from there, so a composed model is ordinary
code: it can be read, stepped through, run without numba, and numba caches its machine code.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from fish_env.errors import OutputError
from fish_env.files import write_text
from fish_env.model import jit
from fish_env.model.effect import STAGES, Effect
from fish_env.model.emit import BASE_TERMS, HEADER, Emitter
from fish_env.model.kernel_cache import cache_root
from fish_env.model.state import BASE_STATES
from fish_env.params.packing import RECORD_FIELDS

TEMPLATE = Path(__file__).with_name("rollout_template.py")
_BEGIN = "# --- completed by compose ---"
_END = "# --- end ---"


def _kept_imports(template: str) -> str:
    """The template's own imports: what stands between ``import numpy`` and the marked part."""
    before = template[: template.index(_BEGIN)]
    return before[before.index("import numpy as np") :]


@dataclass(frozen=True)
class Composition:
    """Which effects a kernel contains, and whether coefficient tables can be used.

    Attributes:
        effects: effects in the order their hooks run.
        tables: coefficient curves may come from tables (slower: a search for each).
        templates: source files with the entry points; each may use what precedes it.
    """

    effects: tuple[Effect, ...] = ()
    tables: bool = False
    templates: tuple[Path, ...] = (TEMPLATE,)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Rows of the state: the fish, states of effects, then what effects remember."""
        states = (f"{e.name}.{s}" for e in self.effects for s in e.state_names)
        return (*BASE_STATES, *states, *self.memory_names)

    @property
    def memory_names(self) -> tuple[str, ...]:
        """The last rows of the state: kept from step to step, not integrated."""
        return tuple(f"{e.name}.{m}" for e in self.effects for m in e.memory_names)

    @property
    def tail_rows(self) -> list[int]:
        """Rows of states that follow the tail's phase."""
        names = [f"{e.name}.{state}" for e in self.effects for state in e.states.get("tail", ())]
        return [self.state_names.index(name) for name in names]

    @property
    def delays(self) -> tuple[str, ...]:
        """Parameters by which the tail's command is late (s)."""
        return tuple(f"{e.name}.{e.command_delay}" for e in self.effects if e.command_delay)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Rows of the parameter record: the fish, then ``effect.parameter``."""
        extra = (f"{e.name}.{p.name}" for e in self.effects for p in e.parameters)
        return (*RECORD_FIELDS, *extra)

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the wrench terms."""
        extra = (e.name for e in self.effects if {"wrench", "tail_force"} & set(e.hooks))
        return (*BASE_TERMS, *extra)

    @property
    def label(self) -> str:
        """Short name of the generated file."""
        names = ",".join(effect.name for effect in self.effects) + (
            "|tables" if self.tables else ""
        )
        kind = "baseline" if not self.effects else f"effects{len(self.effects)}"
        return f"{kind}_{hashlib.sha256(names.encode()).hexdigest()[:8]}"

    def source(self) -> str:
        """The composed module as text."""
        texts = [path.read_text(encoding="utf-8") for path in self.templates]
        bodies = [text[text.index(_END) :] for text in texts]
        imports = [_kept_imports(text) for text in texts]
        return "\n".join([HEADER, *imports, Emitter(self).text(), *bodies])


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
        for hook in (*effect.hooks.values(), effect.initial_states)
    ]
    return cache_root() / jit.source_hash(files, codes)


def load(composition: Composition) -> ModuleType:
    """Import the composed module, writing it to the cache folder first if it is new."""
    folder = cache_folder(composition)
    name = f"robofish_composed_{composition.label}_{folder.name}"
    if name in sys.modules:
        return sys.modules[name]
    path, source = folder / f"{composition.label}.py", composition.source()
    kept = _kept(path, source)
    try:
        module = _executed(composition, name, path, None if kept else source)
    except (EOFError, ValueError, TypeError):  # a damaged bytecode file; the source is as it should
        Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)
        module = _executed(composition, name, path, None if kept else source)
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
    if effect.initial_states is not None:
        setattr(module, f"{effect.name}_initial", effect.initial_states)
