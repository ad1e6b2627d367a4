"""Compose baseline and effects into one source text, and compile it.

The text is written to a cache folder and imported from there, so a composed model is ordinary
code: it can be read, stepped through, run without numba, and numba caches its machine code.
"""

from __future__ import annotations

import importlib.util
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

from fish_env.errors import OutputError
from fish_env.files import write_text
from fish_env.model import jit
from fish_env.model.composition import Composition
from fish_env.model.effect import STAGES, Effect
from fish_env.model.emit_block_corners import BlockCornerEmitter
from fish_env.model.kernel_cache import cache_root

HEADER = '''"""Composed physics, generated: edit the sources in fish_env/model and effects."""
import math

import numpy as np

from fish_env.model.body import (
    damping_moment, impact_moment, plane_flow, plane_xy_velocity, plane_xz_velocity,
    relative_motion,
)
from fish_env.model.coefficients import (
    analytic_drag, analytic_lift, analytic_moment, table_drag, table_lift, table_moment,
)
from fish_env.model.frames import quaternion_rate, rotation, to_body, to_inertial
from fish_env.model.history import (
    HEARD, RECORD, assume_running, late_command, recall_at, remember, running_command,
    told_anew,
)
from fish_env.model.hydrostatics import buoyancy_force, gravity_wrench
from fish_env.model.jit import entry_point, kernel, lean_entry_point, shared_kernel
from fish_env.model.mass_properties import barycentre, rigid_inertia
from fish_env.model.newton_euler import inertial_wrench, solve_full, solve_rigid
from fish_env.model.plate import drag_force, lift_force, speed_and_inverse
from fish_env.model.records import Barycentre, Fish, Inputs, Tail, Vector, Wrench
from fish_env.model.tail import (
    TWO_PI, commanded_tail, hinge_power, tail_arm, tail_velocity, tail_wrench, wrench_at,
)
'''
_TYPES = "from __future__ import annotations\n"
_BEGIN = "# --- completed by compose ---"
_END = "# --- end ---"


def _kept_imports(template: str) -> str:
    """The template's own imports: what stands between the one for types and the marked part."""
    before = template[: template.index(_BEGIN)]
    return before.partition(_TYPES)[2]


def source(composition: Composition) -> str:
    """The composed module as text."""
    texts = [path.read_text(encoding="utf-8") for path in composition.templates]
    bodies = [text[text.index(_END) :] for text in texts]
    imports = [_kept_imports(text) for text in texts]
    return "\n".join([HEADER, *imports, BlockCornerEmitter(composition).text(), *bodies])


def cache_folder(composition: Composition) -> Path:
    """Where a composed module is kept; another folder after an edit of anything it draws on."""
    files = [effect.file for effect in composition.effects if effect.file is not None]
    for template in composition.templates:
        files += jit.sources_behind(template)
    # An effect made in Python has no file to tell one version from the next: its code does.
    codes = [
        jit.fingerprint(kernel)
        for effect in composition.effects
        if effect.file is None
        for kernel in _kernels_of(effect).values()
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
    for name, kernel in _kernels_of(effect).items():
        setattr(module, f"{effect.name}_{name}", kernel)


def _kernels_of(effect: Effect) -> dict[str, Callable[..., Any]]:
    """What the composed source calls of an effect, by the ending of its name there."""
    found = {
        **{stage: effect.hooks.get(stage) for stage in STAGES},
        "initial": effect.initial_states,
        "turns": effect.turns,
        "corner": effect.corner,
        "settling": effect.settling,
    }
    return {ending: kernel for ending, kernel in found.items() if kernel is not None}
