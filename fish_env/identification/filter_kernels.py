"""Compiled filters: one for each set of effects, and one replay for all of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from threading import Lock

from fish_env.effects.extended import ExtendedModel
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.model.composition import Composition
from fish_env.model.runtime import Kernels, kernels

TEMPLATES = tuple(
    Path(__file__).with_name(f"{name}_template.py")
    for name in ("observation", "error_state", "filter")
)
REPLAY_TEMPLATE = Path(__file__).with_name("replay_template.py")

_LOADING = Lock()


def filter_kernels(model: ExtendedModel) -> Kernels:
    """Compiled filter for a model whose last effect is the applied wrench."""
    composition = model.kernels.composition
    assert composition.effects[-1].name == APPLIED_WRENCH.name
    return _loaded(composition.in_blocks(TEMPLATES))


def replay_kernels() -> Kernels:
    """Compiled replay of a filtered run. It moves no fish, so no effect matters to it."""
    plain = Composition()
    return _loaded(replace(plain, templates=(*plain.templates, REPLAY_TEMPLATE)))


def _loaded(composition: Composition) -> Kernels:
    with _LOADING:  # fits side by side may ask for the same kernel
        return kernels(composition)
