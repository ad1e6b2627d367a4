"""Films of scenes, through the ffmpeg that comes with imageio-ffmpeg."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from fish_env.errors import ConfigError, missing_extra
from fish_env.files import replacing
from fish_env.rendering.scene import Scene, Setting, between
from fish_env.rendering.views import View
from fish_env.version import WRITER

QUALITY = 6
"""Of imageio-ffmpeg, 0 to 10."""
ENCODER = ("-preset", "veryfast")
"""Options of ffmpeg. Its own choice, medium, takes longer for a frame than drawing does; this one
takes 40 % of that and makes files a tenth smaller, with half a decibel more noise."""


def write(
    path: Path,
    scenes: Sequence[Scene],
    setting: Setting,
    fps: float,
    size: tuple[int, int],
    report: Callable[[], object],
) -> Path:
    """As :func:`fish_env.rendering.write_video`."""
    try:
        from imageio_ffmpeg import read_frames, write_frames
    except ImportError:
        raise missing_extra("Writing a video", "imageio-ffmpeg", "render") from None
    if size[0] % 2 or size[1] % 2:
        raise ConfigError(f"a video of {size[0]} x {size[1]} pixels: both must be even")
    moments = in_between(scenes, fps)
    view = View(setting, size)
    with replacing(path) as part, _in_one_line():
        writer = write_frames(
            str(part),
            size,
            fps=fps,
            quality=QUALITY,
            macro_block_size=2,
            ffmpeg_log_level="quiet",
            output_params=[*ENCODER, "-metadata", f"comment={WRITER}"],
        )
        writer.send(None)
        try:
            for scene in moments:
                writer.send(view.frame(scene))
                report()
        finally:
            writer.close()
        if part.is_file():
            # ffmpeg stays silent about a full disk; what it then leaves cannot be opened.
            opened = read_frames(str(part))
            next(opened)
            opened.close()
    return path


@contextmanager
def _in_one_line() -> Iterator[None]:
    """Words the failure of ffmpeg, which imageio-ffmpeg tells with its command on many lines."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if "\n" not in str(error):
            raise
        raise OSError(errno.EIO, "ffmpeg ended early, perhaps on a full disk") from error


def in_between(scenes: Sequence[Scene], fps: float) -> Iterator[Scene]:
    """Scenes ``fps`` times a second, from the first to the last.

    Raises:
        ConfigError: fewer than two scenes, times that do not increase, or no frame rate.
    """
    times = np.array([scene.time_s for scene in scenes])
    if len(times) < 2 or np.any(np.diff(times) <= 0.0):
        raise ConfigError("a video needs at least two scenes whose times increase")
    if not 0.0 < fps <= 240.0:
        raise ConfigError(f"fps = {fps}: choose a frame rate up to 240")
    return _moments(scenes, times, fps)


def _moments(scenes: Sequence[Scene], times: np.ndarray, fps: float) -> Iterator[Scene]:
    count = int(np.floor((times[-1] - times[0]) * fps + 1e-9)) + 1
    for moment in times[0] + np.arange(count) / fps:
        after = int(np.clip(np.searchsorted(times, moment), 1, len(times) - 1))
        first, last = scenes[after - 1], scenes[after]
        share = (moment - first.time_s) / (last.time_s - first.time_s)
        yield between(first, last, float(np.clip(share, 0.0, 1.0)))
