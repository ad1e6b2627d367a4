"""Compiled drawing against the drawing library, and against the same code in plain Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path as FilePath

import numpy as np
import pygame
import pytest
from matplotlib.path import Path

from fish_env.rendering import Setting, Tank, view
from fish_env.rendering.raster import fill, numbers, shrunk
from tests.rendering.scenes import AHEAD, SETTING, line_of, scene

PICTURES = FilePath(__file__).parent / "pictures"
ROOT = FilePath(__file__).resolve().parents[2]
WALLED = Setting(SETTING.shape, Tank(top=0.2, walls=(-1.0, 1.0, -0.75, 0.75)))
TILTED = scene((0.4, -0.5, 2.0), position=np.array([0.3, 0.2, 0.5]), goal=None, speed=0.21)
SMALL = (96, 64)


def random_surface(size: tuple[int, int]) -> pygame.Surface:
    surface = pygame.Surface(size, 0, 32)
    colours = np.random.default_rng(0).integers(0, 256, (*size, 3))
    pygame.surfarray.blit_array(surface, colours)
    return surface


def colours(surface: pygame.Surface) -> np.ndarray:
    return pygame.surfarray.array3d(surface).astype(int)


@pytest.mark.parametrize("size", [(64, 48), (34, 2), (2, 2), (63, 47), (96, 72)])
def test_a_smaller_picture_is_that_of_the_drawing_library(size):
    """Half the size is computed here, any other by the library."""
    large, small = random_surface(size), (32, 24) if size[0] > 34 else (size[0] // 2, 1)
    expected = pygame.transform.smoothscale(large, small)
    np.testing.assert_array_equal(colours(shrunk(large, small)), colours(expected))


def covered(outline: np.ndarray) -> np.ndarray:
    """Where a filled outline is white, (height, width)."""
    surface = pygame.Surface((48, 40), 0, 32)
    fill(numbers(surface), outline[None], np.array([0xFFFFFF]), np.array([255]))
    return colours(surface)[..., 0].T > 0


CENTRES = np.stack(np.meshgrid(np.arange(48) + 0.5, np.arange(40) + 0.5), axis=-1)


def away(outline: np.ndarray) -> np.ndarray:
    """Distances (height, width) of the middles of pixels from the nearest side of an outline."""
    found = []
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        side = end - start
        share = np.clip((CENTRES - start) @ side / (side @ side), 0.0, 1.0)
        found.append(np.linalg.norm(CENTRES - start - share[..., None] * side, axis=-1))
    return np.min(found, axis=0)


def star(corners: int, rng: np.random.Generator) -> np.ndarray:
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    radius = rng.uniform(6.0, 16.0, corners)
    return np.column_stack([24 + radius * np.cos(angle), 20 + radius * np.sin(angle)])


@pytest.mark.parametrize("corners", [4, 7, 29])
def test_a_polygon_covers_the_pixels_inside_and_at_most_its_rim(corners):
    rng = np.random.default_rng(corners)
    for _ in range(200):
        outline = star(corners, rng)
        own = covered(outline)
        inside = Path(outline).contains_points(CENTRES.reshape(-1, 2)).reshape(own.shape)
        assert not (inside & ~own & (away(outline) > 1e-6)).any()
        assert not (own & ~inside & (away(outline) > 1.0)).any()


def test_a_plate_seen_edge_on_stays_a_line():
    upright = np.array([[5.2, 3.0], [5.2, 30.0], [5.2, 30.0], [5.2, 3.0]])
    level = upright[:, ::-1].copy()
    assert covered(upright)[3:30, 5].all()
    assert covered(level)[5, 3:30].all()
    assert covered(np.full((4, 2), 7.3)).sum() == 1


def test_what_is_beside_the_picture_is_not_drawn():
    for shift in ([-60.0, 0.0], [60.0, 0.0], [0.0, -60.0], [0.0, 60.0]):
        assert not covered(np.array([[4.0, 4.0], [30, 5], [30, 30], [3, 30]]) + shift).any()
    assert covered(np.array([[-1e6, -1e6], [1e6, -1e6], [1e6, 1e6], [-1e6, 1e6]])).all()


@pytest.mark.parametrize("alpha", [0, 1, 36, 128, 254, 255])
def test_a_colour_that_lets_things_through_is_mixed_to_the_nearest(alpha):
    surface = random_surface((48, 40))
    before, colour = colours(surface), (200, 30, 120)
    whole = np.array([[[0.0, 0.0], [48, 0], [48, 40], [0, 40]]])
    packed = np.array([surface.map_rgb(colour)])
    fill(numbers(surface), whole, packed, np.array([alpha]))
    exact = before + alpha / 255.0 * (np.array(colour) - before)
    assert np.abs(colours(surface) - exact).max() <= 1.5


@pytest.mark.parametrize(
    ("name", "setting", "moment"),
    [("goal", SETTING, scene(goal=AHEAD, wake=line_of(80))), ("walls", WALLED, TILTED)],
    ids=["goal", "walls"],
)
def test_pictures_look_as_they_did_before_drawing_was_compiled(name, setting, moment):
    """The files were made by the numpy renderer of version 0.2.0; rims of faces differ."""
    before = colours(pygame.image.load(PICTURES / f"{name}.png")).transpose(1, 0, 2)
    differing = np.abs(view(setting, (320, 240)).frame(moment).astype(int) - before)
    assert differing.mean() < 0.5
    assert (differing.max(axis=-1) > 24).mean() < 0.005


def test_the_comparison_of_pictures_notices_a_small_turn_of_the_fish():
    turned = view(SETTING, (320, 240)).frame(scene((0.0, 0.0, 0.35), wake=line_of(80)))
    before = colours(pygame.image.load(PICTURES / "goal.png")).transpose(1, 0, 2)
    assert (np.abs(turned.astype(int) - before).max(axis=-1) > 24).mean() > 0.01


@pytest.mark.slow
def test_the_compiled_picture_is_that_of_the_same_code_in_plain_python(tmp_path):
    file = tmp_path / "picture.npy"
    code = (
        "import numpy as np; from tests.rendering.test_raster import plain; "
        f"np.save({str(file)!r}, plain())"
    )
    subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        check=True,
    )
    np.testing.assert_array_equal(np.load(file), plain())


def plain() -> np.ndarray:
    """A small picture with everything in it."""
    return view(SETTING, SMALL).frame(scene(goal=AHEAD, wake=line_of(80)))
