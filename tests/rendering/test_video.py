"""Films: as many frames as they should have, moving, and refusals."""

import sys

import numpy as np
import pytest
from imageio_ffmpeg import count_frames_and_secs, read_frames

from fish_env.errors import ConfigError, MissingExtraError, OutputError
from fish_env.rendering import write_video
from fish_env.rendering.video import in_between
from tests.rendering.scenes import SETTING, changed, scene


def swim(count: int = 6):
    return [
        scene(time_s=0.1 * i, position=np.array([0.02 * i, 0.0, 0.5]), tail_angle=0.3 * (-1) ** i)
        for i in range(count)
    ]


def test_a_film_runs_in_real_time(tmp_path):
    """Half a second at 30 frames a second, from six scenes."""
    seen = []
    file = write_video(
        tmp_path / "deep" / "swim.mp4",
        swim(),
        SETTING,
        size=(160, 120),
        report=lambda: seen.append(1),
    )
    frames, seconds = count_frames_and_secs(str(file))
    assert frames == len(seen) == 16
    assert seconds == pytest.approx(16 / 30, abs=0.04)


def test_a_film_shows_the_fish_moving(tmp_path):
    file = write_video(tmp_path / "swim.mp4", swim(), SETTING, size=(160, 120))
    reader = read_frames(str(file))
    next(reader)
    frames = [np.frombuffer(data, np.uint8).reshape(120, 160, 3) for data in reader]
    assert changed(frames[0], frames[3]).sum() > 30
    assert changed(frames[0], frames[0]).sum() == 0


def test_moments_lie_where_their_times_say():
    moments = list(in_between(swim(), 40.0))
    np.testing.assert_allclose([m.time_s for m in moments], np.arange(21) / 40.0)
    np.testing.assert_allclose([m.position[0] for m in moments], 0.2 * np.arange(21) / 40.0)


@pytest.mark.parametrize("scenes", [[], swim(1), swim()[::-1]])
def test_scenes_that_make_no_film_are_refused(tmp_path, scenes):
    with pytest.raises(ConfigError, match="at least two scenes"):
        write_video(tmp_path / "swim.mp4", scenes, SETTING)


def test_odd_sizes_and_frame_rates_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="must be even"):
        write_video(tmp_path / "swim.mp4", swim(), SETTING, size=(161, 120))
    with pytest.raises(ConfigError, match="fps"):
        write_video(tmp_path / "swim.mp4", swim(), SETTING, fps=0.0)


def test_a_film_that_ffmpeg_cannot_write_is_refused_in_one_line(tmp_path, capfd):
    """A device that is full stands for the disk."""
    (tmp_path / "swim.mp4").symlink_to("/dev/full")
    with pytest.raises(OutputError, match="ffmpeg ended early") as caught:
        write_video(tmp_path / "swim.mp4", swim(), SETTING)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_missing_ffmpeg_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match=r"pip install .*imageio-ffmpeg"):
        write_video(tmp_path / "swim.mp4", swim(), SETTING)
