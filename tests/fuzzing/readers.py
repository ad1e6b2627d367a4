"""Every reader of files, and what it may do with a file that is wrong."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fish_env.commands.case import read_case
from fish_env.data import load_dataset
from fish_env.data.importing import parse_plan, read_content
from fish_env.envs.config import load_env_config
from fish_env.envs.record import read_episode
from fish_env.errors import RoboticFishError
from fish_env.params import fish_files, load_fish
from fish_env.replay.reading import read_replay_file
from robofish_agents.evaluation.results import read_results
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies.files import read_policy
from robofish_agents.swimming import read_waypoints
from robofish_agents.training.config import load_train_config

LONGEST_S = 10.0
"""A reader takes at most a few seconds for any file; the rest is for slow machines."""
LONGEST_MESSAGE = 1200
"""Without the folders in it, which are as long as they are."""
FOLDERS = re.compile(r"(/[^/\s]+)+/")

READERS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "fish": (load_fish, ".yaml"),
    "files of a fish": (fish_files, ".yaml"),
    "dataset": (load_dataset, ".yaml"),
    "environment": (load_env_config, ".yaml"),
    "suite": (load_suite, ".yaml"),
    "training": (load_train_config, ".yaml"),
    "case": (read_case, ".json"),
    "results": (read_results, ".json"),
    "replay": (read_replay_file, ".csv"),
    "waypoints": (read_waypoints, ".csv"),
    "mapping": (lambda file: parse_plan(read_content(file), file), ".yaml"),
    "policy": (read_policy, ".npz"),
    "episode": (read_episode, ".npz"),
}


def fault(read: Callable[..., Any], *given: Any, **options: Any) -> str | None:
    """The error that a reader raises on purpose, in words; None if it takes the input.

    Fails on any other error, on a message that is no one line, and on a hang.
    """
    begun = time.monotonic()
    try:
        read(*given, **options)
        message = None
    except RoboticFishError as error:
        message = str(error)
        assert "\n" not in message.strip()
        assert 0 < len(FOLDERS.sub("", message)) < LONGEST_MESSAGE, message[:200]
    assert time.monotonic() - begun < LONGEST_S
    return message
