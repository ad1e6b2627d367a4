"""`robofish swim`: one episode of an agent, with pictures, video and replay page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from rich.console import Console
from rich.progress import Progress

from fish_env.arrays import FloatArray
from fish_env.envs.registration import ENV_ID
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.tasks import TASKS
from fish_env.errors import ConfigError
from fish_env.files import check_chosen, check_outputs
from fish_env.reading import Unreadable, plain_number, read_text
from fish_env.rendering import check_installed
from robofish_agents.controllers.line_of_sight import LineOfSight
from robofish_agents.controllers.path import PathFollower
from robofish_agents.episode import Episode
from robofish_agents.episode import swim as swim_episode
from robofish_agents.evaluation.suites import load_suite, suite_files
from robofish_agents.keep import Keeper
from robofish_agents.pictures import draw_actuators, draw_path, draw_tracking
from robofish_agents.registry import agent_files, load_agents

PATH, TRACKING, ACTUATORS = "path", "tracking", "actuators"
"""Names of the pictures."""
COLUMNS = ("north", "east", "depth")
FARTHEST = 1000.0
"""m. A path as long as this takes three hours."""
MOST_WAYPOINTS = 1000
SLOWNESS = 1.5
"""A path may take this many times as long as its length at cruise speed, and ten seconds."""


@dataclass(frozen=True)
class Wish:
    """Options of `robofish swim`."""

    agent: str
    task: str
    suite: str
    seed: int
    path: Path | None
    out: Path
    video: Path | None
    replay: Path | None
    trust_effects: bool = False
    json: Path | None = None


def swim_and_show(console: Console, wish: Wish) -> Episode:
    """Runs an episode, prints its result, and writes the files that the options name.

    Raises:
        ConfigError: an unknown agent, task or suite, or a path that is none.
        OutputError: an output would replace what is read, or a file of someone else.
        MissingExtraError: a film is asked for, and what draws it is not installed.
    """
    if wish.task not in TASKS:
        raise ConfigError(f"task '{wish.task}': one of {', '.join(TASKS)}")
    if wish.video is not None:
        check_installed()
    read = [wish.path, *suite_files(wish.suite), *agent_files(wish.agent)]
    pictures = [wish.out / f"{name}.png" for name in _pictures(wish)]
    check_outputs([wish.video, wish.replay, wish.json, *pictures], read)
    check_chosen(pictures)
    agent = load_agents(wish.agent, wish.task)[0]
    waypoints = None if wish.path is None else read_waypoints(wish.path)
    env, options = _environment(wish, waypoints)
    fish = env.unwrapped
    assert isinstance(fish, RoboticFish3DEnv)
    follower = None if waypoints is None else PathFollower(agent, LineOfSight(waypoints), fish)
    keeper = Keeper(fish, scenes=wish.video is not None)
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task("swimming", total=env.spec.max_episode_steps if env.spec else None)

        def report() -> None:
            keeper()
            progress.advance(bar)

        def arrived() -> bool:
            return follower is not None and follower.guided[-1].finished

        episode = swim_episode(env, follower or agent, wish.seed, options, report, arrived)
    console.print(_in_words(episode, follower), highlight=False)
    for file in _files(wish, episode, fish, keeper, waypoints):
        console.print(str(file), soft_wrap=True)
    return episode


def _pictures(wish: Wish) -> list[str]:
    """Names of the pictures; along a path of waypoints there is no tracking of goals."""
    return [PATH, *([] if wish.path is not None else [TRACKING]), ACTUATORS]


def read_waypoints(file: Path) -> FloatArray:
    """Waypoints (n, 3) from a CSV file with the columns north, east, depth (m).

    Raises:
        ConfigError: no such file, or not these columns.
    """
    try:
        lines = [line.split(",") for line in read_text(file).splitlines() if line.strip()]
    except FileNotFoundError:
        raise ConfigError(
            f"{file}: no such file; give a CSV file with {', '.join(COLUMNS)}"
        ) from None
    except Unreadable as error:
        raise ConfigError(f"{file}: {error}") from None
    header = tuple(cell.strip() for cell in lines[0]) if lines else ()
    if header != COLUMNS:
        raise ConfigError(f"{file}: the first line must be '{','.join(COLUMNS)}'")
    rows = [[plain_number(cell) for cell in line] for line in lines[1:]]
    for number, row in enumerate(rows, 2):
        if len(row) != len(COLUMNS) or not all(abs(value) <= FARTHEST for value in row):
            raise ConfigError(
                f"{file}: line {number}: give north,east,depth as numbers (m) of at most "
                f"{FARTHEST:g}"
            )
    points = np.array(rows).reshape(-1, len(COLUMNS))
    if not 2 <= len(points) <= MOST_WAYPOINTS or not np.diff(points, axis=0).any(axis=1).all():
        raise ConfigError(
            f"{file}: give 2 to {MOST_WAYPOINTS} waypoints, each at another place than the one "
            "before"
        )
    return points


def _environment(
    wish: Wish, waypoints: FloatArray | None
) -> tuple[gym.Env[Any, Any], dict[str, Any] | None]:
    """The environment, and how its episode begins; on a path: at its start, along it."""
    suite = load_suite(wish.suite, wish.trust_effects)
    mode = None if wish.video is None else "rgb_array"
    task = wish.task if waypoints is None else "hold"
    steps, options = suite.episode_steps, None
    if waypoints is not None:
        legs = np.diff(waypoints[:, :2], axis=0)
        heading = float(np.arctan2(legs[0, 1], legs[0, 0]))
        start = {"position": waypoints[0].tolist(), "euler": (0.0, 0.0, heading)}
        goal = {"depth": float(waypoints[0, 2]), "heading": heading, "cruise_speed": 0.1}
        options = {"state": start, "goal": goal}
        steps = round(SLOWNESS * float(np.hypot(*legs.T).sum()) / 0.1 * 10.0) + 100
    env = gym.make(
        ENV_ID, task=task, max_episode_steps=steps, render_mode=mode, **suite.environment
    )
    return env, options


def _in_words(episode: Episode, follower: PathFollower | None) -> str:
    end = episode.last(10.0)
    duration = f"{episode['time_s'][-1]:.0f} s"
    if episode["failure"][-1] > 0:
        return f"It failed after {duration}: it left the tank, tumbled or diverged."
    if follower is not None:
        away = np.array([guided.cross_track for guided in follower.guided])
        legs = follower.guided[-1].leg + 1
        return (
            f"In {duration} it followed {legs} of {len(follower.path.points) - 1} legs, "
            f"{100 * np.sqrt(np.mean(away**2)):.1f} cm (RMS) beside them."
        )
    verdict = "A success" if episode.succeeded else "No success"
    if end.worst("place_error") > 0:
        distance = 100 * end.worst("place_error")
        return f"{verdict}: over the last 10 s it was at most {distance:.1f} cm from the place."
    beside = 100 * end.worst("cross_track_error")
    return (
        f"{verdict}. Largest errors over the last 10 s: "
        f"{f'{beside:.1f} cm beside its path, ' if beside > 0 else ''}"
        f"{100 * end.worst('depth_error'):.1f} cm in depth, "
        f"{np.degrees(end.worst('heading_error')):.1f} degrees over a tail beat, "
        f"{100 * end.worst('speed_error') / end.worst('goal_speed'):.0f} % of the speed."
    )


def numbers_of(wish: Wish, episode: Episode) -> dict[str, Any]:
    """Returns the result of an episode as numbers.

    Args:
        wish: options of the command.
        episode: the episode.
    """
    end = episode.last(10.0)
    return {
        "agent": wish.agent,
        "task": wish.task,
        "suite": wish.suite,
        "seed": wish.seed,
        "duration_s": episode["time_s"][-1],
        "succeeded": episode.succeeded,
        "failure": episode["failure"][-1],
        "worst_depth_error_m_last_10_s": end.worst("depth_error"),
        "worst_heading_error_rad_last_10_s": end.worst("heading_error"),
        "worst_speed_error_m_s_last_10_s": end.worst("speed_error"),
    }


def _files(
    wish: Wish,
    episode: Episode,
    fish: RoboticFish3DEnv,
    keeper: Keeper,
    waypoints: FloatArray | None,
) -> list[Path]:
    config = fish.options.config
    title = f"{ENV_ID}, {wish.agent}, suite {wish.suite}, seed {wish.seed}"
    path = fish.scene().path
    legs = waypoints if waypoints is not None else (path if len(path) else None)
    files = [draw_path(episode, config, title, wish.out, PATH, legs)]
    if waypoints is None:
        files.append(draw_tracking(episode, config, title, wish.out, TRACKING))
    files.append(draw_actuators(episode, config, wish.out, ACTUATORS))
    if wish.replay is not None:
        files.append(keeper.write_replay(wish.replay, wish.agent))
    if wish.video is not None:
        files.append(keeper.write_video(wish.video))
    return files
