"""What is kept between pictures changes none of them, and does not grow without end."""

from __future__ import annotations

import inspect
import sys
from typing import Any

import numpy as np
import pygame
import pytest

from fish_env.params.io import load_fish
from fish_env.rendering import FishShape, Goal, Scene, Setting, Tank, lettering, surroundings, view
from tests.rendering.scenes import AHEAD, SETTING, line_of, scene

Case = tuple[Setting, tuple[int, int], Scene]
WALLS, NEARER = (-1.0, 1.0, -0.75, 0.75), (-0.75, 1.0, -0.75, 0.5)
SETTINGS = (
    SETTING,
    Setting(FishShape.of(load_fish("msu-tail-fish"))),
    Setting(SETTING.shape, Tank(bottom=1.5)),
    Setting(SETTING.shape, Tank(top=0.2, walls=WALLS)),
    Setting(SETTING.shape, Tank(walls=WALLS)),
    Setting(SETTING.shape, Tank(walls=NEARER)),
    Setting(SETTING.shape, Tank(bottom=1.5, walls=NEARER)),
)
SIZES = ((320, 240), (480, 360), (120, 90))
SCENES = (
    scene(goal=AHEAD, wake=line_of(80)),
    scene((0.4, -0.5, 2.0), position=np.array([1.9, 0.6, 0.4]), goal=None, speed=0.21),
    scene((0.0, 0.3, -1.0), goal=Goal(0.4, -2.0, 0.2), tail_angle=-0.4, label="other"),
)


def caches() -> dict[str, Any]:
    """Every function of the renderer that keeps what it returned."""
    found: dict[str, Any] = {}
    for name, module in list(sys.modules.items()):
        if name.startswith("fish_env.rendering."):
            for value in vars(module).values():
                if hasattr(value, "cache_clear"):
                    found[f"{value.__module__}.{value.__qualname__}"] = value
    return found


def cases() -> list[Case]:
    """Neighbours differ in one thing each: what is kept of one must not serve the next."""
    return [(setting, size, at) for size in SIZES for setting in SETTINGS for at in SCENES]


def fresh(case: Case) -> np.ndarray:
    """The picture of a renderer that has drawn nothing before."""
    for kept in caches().values():
        kept.cache_clear()
    setting, size, at = case
    return view(setting, size).frame(at)


def warm() -> list[np.ndarray]:
    """Pictures of all cases after all have been drawn, by views that drew others before."""
    views = {(id(setting), size): view(setting, size) for setting, size, _ in cases()}
    for _ in range(2):
        pictures = []
        for setting, size, at in cases():
            one = views[id(setting), size]
            # The camera moves smoothly from scene to scene; here each stands for itself.
            one.follower = view(setting, size).follower
            pictures.append(one.frame(at))
    return pictures


def differing(pictures: list[np.ndarray]) -> int:
    """How many pictures of the cases are not those of a fresh renderer."""
    pairs = zip(pictures, cases(), strict=True)
    return sum(not np.array_equal(picture, fresh(case)) for picture, case in pairs)


def test_pictures_of_a_warm_renderer_are_those_of_a_fresh_one():
    assert differing(warm()) == 0


@pytest.mark.parametrize(
    ("module", "name", "constant"),
    [
        (surroundings, "_floor_grid", 2),
        (surroundings, "_wall_lines", 2),
        (lettering, "words", 0),
    ],
    ids=["floor", "walls", "words"],
)
def test_a_broken_key_is_noticed(monkeypatch, module, name, constant):
    """A cache that leaves one argument out of its key."""
    right = getattr(module, name).__wrapped__
    known: dict[Any, Any] = {}

    def careless(*given: Any) -> Any:
        key = (*given[:constant], *given[constant + 1 :])
        return known.setdefault(key, right(*given))

    monkeypatch.setattr(module, name, careless)
    pictures = warm()
    monkeypatch.undo()
    assert differing(pictures) > 0


@pytest.mark.parametrize("between", [pygame.quit, pygame.font.quit])
def test_what_is_kept_outlives_the_quit_of_another_environment(between):
    case = (SETTING, (480, 360), scene(wake=line_of(20)))
    one = view(SETTING, (480, 360))
    before = one.frame(case[2])
    between()
    one.follower = view(SETTING).follower
    np.testing.assert_array_equal(one.frame(case[2]), before)
    np.testing.assert_array_equal(fresh(case), before)


def test_no_cache_grows_without_end():
    found = caches()
    assert len(found) >= 8
    for name, kept in found.items():
        endless = kept.cache_parameters()["maxsize"] is None
        arguments = inspect.signature(kept.__wrapped__).parameters
        assert not (endless and arguments), name
