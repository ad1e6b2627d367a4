"""The environment's part of the demonstration: words that agree with the swims, and pictures."""

from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from rich.console import Console

from fish_env.commands.demo import GROUP
from fish_env.envs.config import load_env_config
from robofish_agents import demo
from robofish_agents.episode import Episode

CONFIG = load_env_config(None, None, None)


def episode(depth_error: float, succeeded: bool) -> Episode:
    """Fifteen seconds at constant errors."""
    steps = 150
    constants = {
        "depth_error": depth_error,
        "heading_error": np.radians(-2.0),
        "heading_error_instant": np.radians(4.0),
        "speed_error": -0.005,
        "goal_speed": 0.1,
        "is_success": float(succeeded),
    }
    info = {key: np.full(steps, value) for key, value in constants.items()}
    return Episode(info, np.zeros((steps, 5)), np.zeros((steps, 5)), 0.1)


def test_the_words_count_and_measure():
    swims = [episode(0.01, True), episode(-0.02, True), episode(0.3, False)]
    first, second = demo.in_words(swims, CONFIG)
    assert first.startswith("2 of 3 swims")
    assert "depth within 5 cm, heading within 5 degrees and speed within 20 % for 10 s" in first
    assert "median over the swims: 2.0 cm, 2.0 degrees over a tail beat (4.0 instant" in second
    assert "instantaneous) and 5 % of the speed" in second
    assert "Maximum over the swims: 30.0 cm" in second


def test_the_end_of_an_episode_leaves_its_beginning_out():
    swim = episode(0.01, True)
    swim.info["depth_error"][:50] = 9.0
    assert swim.worst("depth_error") == 9.0
    assert swim.last(10.0).worst("depth_error") == 0.01


def test_it_is_a_part_of_the_demonstration():
    assert [entry.load() for entry in entry_points(group=GROUP)] == [demo.swim]


@pytest.mark.slow
def test_it_swims_and_draws(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.setattr(demo, "SEEDS", range(demo.SHOWN, demo.SHOWN + 2))
    pictures = demo.swim(Console(), tmp_path)
    assert [p.name for p in pictures] == [
        "swim_hold.png",
        "swim_actuators.png",
        "swim_track.png",
        "swim_path.png",
    ]
    for picture in pictures:
        assert np.std(imread(picture)[..., :3]) > 0.05
    assert "2 of 2 swims" in capsys.readouterr().out
