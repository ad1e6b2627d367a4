"""The window: what the mouse and the keys do, in real time, and how it is closed."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pygame
import pytest

from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.errors import ConfigError
from fish_env.rendering import window as open_window
from fish_env.rendering.windows import Window
from tests.conformance.cases import random_actions
from tests.rendering.scenes import SETTING, scene

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "out" / "screenshots"


@pytest.fixture
def window():
    """A small window that nobody sees."""
    opened = open_window(SETTING, 1, (160, 120))
    opened.show([scene()])
    yield opened
    opened.close()


def send(window: Window, kind: int, **what) -> None:
    """As if the user had done it to this window."""
    pygame.event.post(pygame.event.Event(kind, window=window._window, **what))


def press(window: Window, key: int) -> None:
    send(window, pygame.KEYDOWN, key=key)


def follower(window: Window):
    return window._mosaic.views[0].follower


def test_it_takes_as_long_as_the_fish_does(window):
    """Half a second of swimming takes half a second, whatever the number of scenes."""
    started = time.monotonic()
    for i in range(1, 6):
        window.show([scene(time_s=5.0 + 0.1 * i)])
    assert 0.35 < time.monotonic() - started < 2.0


def test_dragging_and_the_wheel_move_the_camera_and_r_puts_it_back(window):
    before = (follower(window).azimuth, follower(window).elevation, follower(window).distance)
    send(window, pygame.MOUSEMOTION, buttons=(1, 0, 0), rel=(30, 20), pos=(50, 50))
    send(window, pygame.MOUSEWHEEL, x=0, y=1)
    window.show([scene()])
    assert follower(window).azimuth != before[0]
    assert follower(window).elevation > before[1]
    assert follower(window).distance < before[2]
    press(window, pygame.K_r)
    window.show([scene()])
    assert (
        follower(window).azimuth,
        follower(window).elevation,
        follower(window).distance,
    ) == before


def test_moving_the_mouse_without_a_button_does_nothing(window):
    before = follower(window).azimuth
    send(window, pygame.MOUSEMOTION, buttons=(0, 0, 0), rel=(30, 20), pos=(50, 50))
    window.show([scene()])
    assert follower(window).azimuth == before


def test_the_space_bar_stops_it_until_it_is_pressed_again(window, monkeypatch):
    press(window, pygame.K_SPACE)
    waited = []

    def wait(frames):
        waited.append(frames)
        if len(waited) == 5:
            press(window, pygame.K_SPACE)

    monkeypatch.setattr(window, "_clock", type("Clock", (), {"tick": staticmethod(wait)}))
    window.show([scene(time_s=5.1)])
    assert len(waited) >= 5
    assert not window.paused


def test_a_full_stop_lets_one_step_by(window):
    press(window, pygame.K_PERIOD)
    window.show([scene(time_s=5.1)])
    assert window.paused
    assert window.is_open


def test_h_shows_and_hides_the_keys(window):
    def picture() -> np.ndarray:
        window.show([scene()])
        return pygame.surfarray.array3d(window._window.get_surface())

    window._noted_until = 0.0
    plain = picture()
    press(window, pygame.K_h)
    picture()
    assert not np.array_equal(picture(), plain)
    press(window, pygame.K_h)
    picture()
    np.testing.assert_array_equal(picture(), plain)


@pytest.mark.parametrize("size", [(160, 120), (300, 500), (900, 200)])
def test_it_draws_in_whatever_size_it_is_given(window, size):
    window._window.size = size
    window.show([scene()])
    assert window._mosaic.size == size


@pytest.mark.parametrize("how", ["button", "escape", "q", "quit", "close"])
def test_closing_it_is_clean(window, how):
    """Afterwards there is nothing to see, nothing to wait for, and nothing that fails."""
    if how == "close":
        window.close()
    elif how == "quit":
        pygame.event.post(pygame.event.Event(pygame.QUIT))
    elif how == "button":
        send(window, pygame.WINDOWCLOSE)
    else:
        press(window, pygame.K_ESCAPE if how == "escape" else pygame.K_q)
    window.show([scene(time_s=5.1)])
    assert not window.is_open
    started = time.monotonic()
    window.show([scene(time_s=5.9)])
    assert time.monotonic() - started < 0.2
    window.close()


def test_closing_a_paused_window_lets_the_program_go_on(window):
    press(window, pygame.K_SPACE)
    press(window, pygame.K_ESCAPE)
    window.show([scene(time_s=5.1)])
    assert not window.is_open


def test_each_of_two_windows_hears_its_own_user(window):
    other = open_window(SETTING, 1, (160, 120))
    other.show([scene()])
    before = follower(other).azimuth
    send(window, pygame.MOUSEMOTION, buttons=(1, 0, 0), rel=(30, 0), pos=(50, 50))
    other.show([scene()])
    assert follower(other).azimuth == before
    assert follower(window).azimuth != before
    other.close()
    window.show([scene()])
    assert window.is_open


def test_the_environment_goes_on_after_the_user_closed_its_window():
    env = RoboticFish3DEnv(render_mode="human", render_size=(160, 120))
    env.reset(seed=0)
    assert env.window_open
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for action in random_actions(3):
        env.step(action)
    assert not env.window_open
    env.reset(seed=1)
    assert not env.window_open
    env.close()
    env.close()


def test_a_window_without_a_screen_is_refused(monkeypatch):
    """Drawing where nobody sees it would hide the mistake."""
    pygame.display.quit()
    monkeypatch.delenv("SDL_VIDEODRIVER")
    monkeypatch.setattr(pygame.display, "init", lambda: None)
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    with pytest.raises(ConfigError, match="there is no screen"):
        open_window(SETTING)


def test_a_window_and_its_words_outlive_the_quit_of_another_environment(window):
    """Gymnasium's own environments call pygame.quit when they close."""
    window.show([scene(time_s=5.1)])
    pygame.quit()
    window.show([scene(time_s=5.2)])
    assert window.is_open
    pygame.quit()
    pygame.init()
    window.show([scene(time_s=5.3, speed=0.1234)])
    assert window.is_open
    press(window, pygame.K_ESCAPE)
    window.show([scene(time_s=5.4)])
    assert not window.is_open


def test_a_closed_window_stays_closed_after_the_quit_of_another(window):
    window.close()
    pygame.quit()
    window.show([scene(time_s=5.1)])
    assert not window.is_open


@pytest.mark.parametrize("between", [pygame.quit, pygame.font.quit])
def test_pictures_have_words_after_the_quit_of_another_environment(between):
    env = RoboticFish3DEnv(render_mode="rgb_array", render_size=(160, 120))
    env.reset(seed=0)
    env.render()
    between()
    for action in random_actions(3):
        env.step(action)
        assert env.render().std() > 1


UNSEEN = """
import sys, warnings, gymnasium as gym
from gymnasium.utils.env_checker import check_env
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    env = gym.make("fish_env:RoboticFish3D-v0", render_size=(64, 48))
    check_env(env.unwrapped)
    watched = gym.make("fish_env:RoboticFish3D-v0", render_mode="human")
    watched.reset(seed=0)
    watched.step(watched.action_space.sample())
assert not watched.unwrapped.window_open
texts = [str(warning.message) for warning in caught]
assert any("there is no screen" in text for text in texts), texts
"""


def test_environments_pass_the_checker_without_a_screen():
    """With a warning, not an error: the checker tries every mode."""
    hidden = {"SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"}
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    subprocess.run([sys.executable, "-c", UNSEEN], env=environment, check=True, cwd=ROOT)


DRIVE = """
import sys, pygame, gymnasium as gym
env = gym.make("fish_env:RoboticFish3D-v0", render_mode="human")
env.reset(seed=0)
window = env.unwrapped._viewer._window
assert pygame.display.get_driver() == "x11", pygame.display.get_driver()
for _ in range(4):
    env.step(env.action_space.sample())
pygame.image.save(window._window.get_surface(), sys.argv[1])
window._window.size = (400, 300)
env.step(env.action_space.sample())
assert window._mosaic.size == (400, 300)
pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=window._window))
env.step(env.action_space.sample())
assert not env.unwrapped.window_open
env.close()
"""


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs a virtual screen: install Xvfb")
def test_the_window_on_a_virtual_screen():
    """On a real X server: opens, draws, is resized, is closed by the user."""
    reading, writing = os.pipe()
    command = [
        "Xvfb",
        "-displayfd",
        str(writing),
        "-screen",
        "0",
        "1024x768x24",
        "-nolisten",
        "tcp",
    ]
    server = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    PICTURES.mkdir(parents=True, exist_ok=True)
    picture = PICTURES / "window.png"
    picture.unlink(missing_ok=True)
    try:
        with os.fdopen(reading) as pipe:
            display = f":{pipe.readline().strip()}"
        environment = {**os.environ, "DISPLAY": display}
        environment.pop("SDL_VIDEODRIVER", None)
        subprocess.run(
            [sys.executable, "-W", "error", "-c", DRIVE, str(picture)],
            env=environment, check=True, timeout=120, cwd=ROOT,
        )  # fmt: skip
    finally:
        server.terminate()
        server.wait()
    drawn = pygame.surfarray.array3d(pygame.image.load(picture))
    assert drawn.shape == (640, 480, 3)
    assert drawn.std() > 10.0
