"""Pictures of an episode: goals and tracking, actuators, and path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.envs.config import EnvConfig
from fish_env.plotting.style import BLACK, BLUE, COLOUR_MAP, SKY, VERMILION, drawing, save
from robofish_agents.episode import Episode

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ACTUATORS = (
    ("tail offset", "deg", 180 / np.pi),
    ("tail amplitude", "deg", 180 / np.pi),
    ("tail frequency", "Hz", 1.0),
    ("block displacement", "mm", 1000.0),
    ("block angle", "deg", 180 / np.pi),
)
"""Name, unit shown, and how many of those make one SI unit."""
_GOAL: dict[str, Any] = {"color": BLACK, "ls": "--", "lw": 1.1, "label": "goal"}


def draw_tracking(episode: Episode, config: EnvConfig, title: str, folder: Path, name: str) -> Path:
    """Draws depth, heading and speed with their goals; bands are the limits of success."""
    success = config.tree["success"]
    time, goal_speed = episode["time_s"], episode["goal_speed"]
    goal_heading = np.unwrap(episode["goal_heading"])
    band = np.maximum(success["speed"] * goal_speed, success["speed_floor"])
    with drawing(7.2, 6.2) as figure:
        depth, heading, speed = figure.subplots(3, 1, sharex=True)
        _against_goal(depth, time, episode["goal_depth"], np.asarray(success["depth"]), 1.0)
        depth.plot(time, episode["depth"], color=BLUE, label="fish")
        depth.set_ylabel("depth (m)")
        depth.invert_yaxis()
        depth.set_title(title, loc="left")
        degrees = 180 / np.pi
        _against_goal(heading, time, goal_heading, np.asarray(success["heading"]), degrees)
        instant = goal_heading - episode["heading_error_instant"]
        heading.plot(time, degrees * instant, color=SKY, lw=0.8, label="at this instant")
        over_beat = goal_heading - episode["heading_error"]
        heading.plot(time, degrees * over_beat, color=BLUE, label="over the last beat")
        heading.set_ylabel("heading (deg)")
        _against_goal(speed, time, goal_speed, band, 1.0)
        speed.plot(time, episode["speed"], color=BLUE, label="over the last beat")
        speed.set_ylabel("speed (m/s)")
        speed.set_xlabel("time (s)")
        for ax in (depth, heading, speed):
            ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        return save(figure, folder, name, ("png",))


def _against_goal(
    ax: Axes, time: FloatArray, goal: FloatArray, band: FloatArray, factor: float
) -> None:
    low, high = factor * (goal - band), factor * (goal + band)
    ax.fill_between(time, low, high, color=BLACK, alpha=0.10, lw=0, label="close enough")
    ax.plot(time, factor * goal, **_GOAL)


def draw_actuators(episode: Episode, config: EnvConfig, folder: Path, name: str) -> Path:
    """Draws target and position of each actuator, over its whole range."""
    with drawing(7.2, 6.6) as figure:
        axes = figure.subplots(len(ACTUATORS), 1, sharex=True)
        for column, (ax, (label, unit, factor)) in enumerate(zip(axes, ACTUATORS, strict=True)):
            asked, reached = episode.targets[:, column], episode.actuators[:, column]
            ax.plot(episode["time_s"], factor * asked, color=VERMILION, label="asked for")
            ax.plot(episode["time_s"], factor * reached, color=BLUE, label="reached")
            low, high = factor * config.low[column], factor * config.high[column]
            ax.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
            ax.set_ylabel(f"{label.replace(' ', chr(10))}\n({unit})")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
        axes[-1].set_xlabel("time (s)")
        figure.align_ylabels()
        return save(figure, folder, name, ("png",))


def draw_path(
    episode: Episode,
    config: EnvConfig,
    title: str,
    folder: Path,
    name: str,
    waypoints: FloatArray | None = None,
) -> Path:
    """Draws the path in three dimensions.

    With waypoints (n, 3) north, east, depth (m): the legs between them. Without: the last goal,
    depth as a plane, heading as an arrow.
    """
    points = np.column_stack([episode["east"], episode["north"], episode["depth"]])
    if waypoints is None:
        arrow = _last_goal(episode, points)
        shown = np.vstack([points, arrow.sum(axis=0)])
    else:
        legs = waypoints[:, [1, 0, 2]]
        shown = np.vstack([points, legs])
    east, north = _square(shown[:, :2])
    with drawing(6.6, 4.6) as figure:
        ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
        if waypoints is None:
            plane = np.full((2, 2), arrow[0, 2])
            ax.plot_surface(*np.meshgrid(east, north), plane, color=BLACK, alpha=0.08, lw=0)
            ax.quiver(*arrow.ravel(), color=BLACK, lw=1.4)
        else:
            ax.plot(*legs.T, color=BLACK, ls="--", lw=1.1)
        line = _draw_line(ax, points, episode["time_s"])
        ax.plot(*points[0], "o", color=BLACK, ms=5)
        ax.text(*(points[0] + (0.0, 0.0, 0.1)), "start", fontsize=8, ha="center")
        ax.set(xlim=east, ylim=north, zlim=(config.tree["tank"]["depth"], 0.0))
        ax.set(xlabel="east (m)", ylabel="north (m)", zlabel="depth (m)")
        ax.set_box_aspect((1.0, 1.0, 0.5), zoom=1.05)
        ax.view_init(elev=26, azim=-75)
        figure.suptitle(title, fontsize=9.5)
        figure.colorbar(line, ax=ax, label="time (s)", shrink=0.6, pad=0.1)
        return save(figure, folder, name, ("png",))


def _last_goal(episode: Episode, points: FloatArray) -> FloatArray:
    """Foot and direction (2, 3) of an arrow at the end of the path, in the goal's plane."""
    goal, heading = float(episode["goal_depth"][-1]), float(episode["goal_heading"][-1])
    way = 0.25 * np.linalg.norm(points[-1] - points[0])
    foot = np.array([points[-1, 0], points[-1, 1], goal])
    return np.stack([foot, [np.sin(heading) * way, np.cos(heading) * way, 0.0]])


def _draw_line(ax: Any, points: FloatArray, time: FloatArray) -> Any:
    """A line through points (n, 3) coloured by time."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    pieces = np.stack([points[:-1], points[1:]], axis=1)
    line = Line3DCollection(pieces, array=time[1:], cmap=COLOUR_MAP, linewidths=2.4)
    return ax.add_collection3d(line)


def _square(points: FloatArray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ends of two axes, equally long so that directions look right, that show all points (n, 2)."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, 0.6 * float(np.max(high - low))
    first, second = ((float(m - half), float(m + half)) for m in middle)
    return first, second
