"""Guidance along paths and to places: geometry, signs, symmetry, and what may be given."""

from itertools import pairwise

import numpy as np
import pytest

from fish_env.envs import guidance
from fish_env.envs.config import load_env_config
from fish_env.envs.layout import MOST_WAYPOINTS, GoalKind
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from fish_env.envs.tasks import GOAL_DRAWS
from fish_env.envs.tasks.path import WALL_MARGIN, path_goal
from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from fish_env.model.jit import py_function

NORTH = [[0.0, 0.0, 0.4], [6.0, 0.0, 0.7]]
CORNER = [[0.0, 0.0, 0.4], [2.0, 0.0, 0.4], [2.0, 2.0, 0.5]]
BEARINGS = np.linspace(-3.0, 3.0, 7)


def path(waypoints, north=0.0, east=0.0, depth=0.5, yaw=0.0, speed=0.1, **goal):
    """Info of the reset of a fish that is placed beside a path."""
    env = RoboticFish3DEnv(task="path")
    state = {
        "position": [north, east, depth],
        "euler": [0.0, 0.0, yaw],
        "velocity_body": [speed, 0.0, 0.0],
    }
    given = {"waypoints": waypoints} if waypoints is not None else {}
    obs, info = env.reset(seed=0, options={"state": state, "goal": given | goal})
    return obs, info


def along(bearing, distance=5.0):
    """Waypoints of a level leg in a direction."""
    return [[0, 0, 0.5], [distance * np.cos(bearing), distance * np.sin(bearing), 0.5]]


@pytest.mark.parametrize("bearing", BEARINGS)
def test_on_a_straight_path_the_goal_is_its_course(bearing):
    obs, info = path(along(bearing), np.cos(bearing), np.sin(bearing), yaw=bearing)
    assert info["goal_heading"] == pytest.approx(bearing, abs=1e-9)
    assert info["cross_track_error"] == pytest.approx(0.0, abs=1e-9)
    assert info["path_progress"] == pytest.approx(0.2)
    np.testing.assert_allclose(obs[[0, 2, 4, 8]], 0.0, atol=1e-6)


@pytest.mark.parametrize("bearing", BEARINGS)
@pytest.mark.parametrize("off", [0.05, 0.3, 1.0])
def test_guidance_turns_towards_the_path_alike_from_both_sides(bearing, off):
    """To starboard of the path it steers to port, by the same angle as from the other side."""
    turns = []
    for side in (off, -off):
        north, east = (
            np.cos(bearing) - side * np.sin(bearing),
            np.sin(bearing) + side * np.cos(bearing),
        )
        obs, info = path(along(bearing), north, east, yaw=bearing)
        assert info["cross_track_error"] == pytest.approx(side)
        turns.append(np.arctan2(obs[4], obs[5]))
        lookahead = load_env_config().tree["goal"]["path"]["guidance"]["lookahead"]
        assert turns[-1] == pytest.approx(-np.arctan(side / lookahead), abs=1e-6)
    assert turns[0] < 0 < turns[1]
    assert turns[0] == pytest.approx(-turns[1], abs=1e-6)


def test_depth_and_its_rate_are_those_of_the_path_abeam():
    obs, info = path(NORTH, north=3.0, east=0.2, depth=0.5)
    assert info["goal_depth"] == pytest.approx(0.55)
    assert info["depth_error"] == pytest.approx(0.05)
    assert 0.1 * obs[2] == pytest.approx(0.05 * 0.1, abs=1e-7)


def test_the_rate_of_the_heading_is_that_of_the_heading():
    """Moving for a moment at the velocity it has changes the goal by rate times time."""
    step, yaw = 1e-3, 0.3
    for radius in (0.7, -0.7):
        goal = {"depth": 0.5, "heading": 0.0, "path_radius": radius}
        found = []
        for k in (0, 1):
            env = RoboticFish3DEnv(task="path")
            place = [0.2 + k * step * 0.1 * np.cos(yaw), 0.1 + k * step * 0.1 * np.sin(yaw), 0.5]
            state = {"position": place, "euler": [0, 0, yaw], "velocity_body": [0.1, 0, 0]}
            obs, info = env.reset(seed=0, options={"state": state, "goal": goal})
            found.append(info["goal_heading"])
        assert (found[1] - found[0]) / step == pytest.approx(0.5 * obs[8], abs=2e-4)


def circle(radius, **goal):
    """Cross-track errors, goal depths, headings and progress around a circle, by the angle."""
    env = RoboticFish3DEnv(task="path")
    length = 4 * np.pi * abs(radius)
    given = {"heading": 0.4, "depth": 0.4, "path_radius": radius, "path_length": length} | goal
    angles, rows = np.linspace(0, 5 * np.pi, 61), []
    env.reset(seed=0, options={"goal": given})
    batch = env._batch
    still = np.array([0, -1, -1, 0, 0], np.float32)
    for angle in angles:
        course = 0.4 + np.sign(radius) * angle
        centre = radius * np.array([-np.sin(0.4), np.cos(0.4)])
        batch.state[:2, 0] = centre - radius * np.array([-np.sin(course), np.cos(course)])
        batch.state[7:13, 0] = 0.0
        info = env.step(still)[4]
        rows.append([info[k] for k in ("cross_track_error", "goal_depth", "path_progress")])
        rows[-1].append(np.angle(np.exp(1j * (info["goal_heading"] - course))))
    return angles, np.array(rows).T


@pytest.mark.parametrize("radius", [0.6, -0.9])
def test_a_helix_has_a_constant_radius_and_pitch(radius):
    """On the circle there is no error, and the depth grows by the pitch in every turn."""
    angles, (across, depth, progress, off) = circle(radius, path_pitch=0.12)
    np.testing.assert_allclose(across, 0.0, atol=1e-4)
    np.testing.assert_allclose(off, 0.0, atol=1e-3)
    turned = np.minimum(angles, 4 * np.pi)
    np.testing.assert_allclose(depth, 0.4 + 0.12 * turned / (2 * np.pi), atol=1e-4)
    np.testing.assert_allclose(progress, turned / (4 * np.pi), atol=1e-4)


@pytest.mark.parametrize("radius", [0.8, -0.8])
def test_a_figure_swings_twice_in_a_turn(radius):
    """Seen from the side, depth over north and south, it is a figure of eight."""
    angles, (across, depth, _, _) = circle(radius, path_swing=0.05, path_pitch=0.0)
    np.testing.assert_allclose(across, 0.0, atol=1e-4)
    np.testing.assert_allclose(depth, 0.4 + 0.05 * np.sin(2 * angles), atol=1e-4)


def test_a_path_with_corners_is_smooth():
    """Along legs and arcs: no jump of course, depth or progress, and no cross-track error."""
    env = RoboticFish3DEnv(task="path")
    env.reset(seed=0, options={"goal": {"waypoints": CORNER}})
    still = np.array([0, -1, -1, 0, 0], np.float32)
    radius = load_env_config().tree["goal"]["path"]["guidance"]["corner"]
    straight = np.stack([np.linspace(0, 2 - radius, 40), np.zeros(40)], axis=1)
    angle = np.linspace(0, np.pi / 2, 40)
    arc = np.stack([2 - radius + radius * np.sin(angle), radius * (1 - np.cos(angle))], axis=1)
    last = np.stack([np.full(40, 2.0), np.linspace(radius, 2.2, 40)], axis=1)
    rows = []
    for place in np.concatenate([straight, arc, last]):
        env._batch.state[:2, 0] = place
        env._batch.state[7:13, 0] = 0.0
        info = env.step(still)[4]
        keys = ("cross_track_error", "goal_heading", "goal_depth", "path_progress")
        rows.append([info[key] for key in keys])
    across, heading, depth, progress = np.array(rows).T
    np.testing.assert_allclose(across, 0.0, atol=1e-4)
    assert np.abs(np.diff(heading)).max() < 0.06
    assert np.abs(np.diff(depth)).max() < 0.005
    assert np.all(np.diff(progress) >= -1e-9)
    assert np.diff(progress).max() < 0.02
    assert (heading[0], heading[-1]) == pytest.approx((0.0, np.pi / 2), abs=1e-3)
    assert (depth[-1], progress[-1]) == pytest.approx((0.5, 1.0), abs=1e-6)


def test_the_shapes_that_are_drawn_fit_in_the_tank_and_the_shares():
    config = load_env_config()
    draws = np.random.default_rng(0).random((GOAL_DRAWS, 6000))
    rows = path_goal(config, draws)
    low, high = config.tree["goal"]["depth"]
    circles = rows["kind"] == GoalKind.CIRCLE
    helix, figure = rows["path_pitch"] != 0, rows["path_swing"] != 0
    assert [np.mean(x) for x in (helix, figure, ~circles)] == pytest.approx([1 / 3] * 3, abs=0.03)
    np.testing.assert_array_equal(circles, helix ^ figure)
    assert np.mean(rows["path_radius"][circles] > 0) == pytest.approx(0.5, abs=0.03)
    turns = rows["path_length"][helix] / (2 * np.pi * np.abs(rows["path_radius"][helix]))
    assert turns.min() >= 1.5 - 1e-9
    end = rows["depth_base"][helix] + turns * rows["path_pitch"][helix]
    assert low - 1e-9 <= end.min() <= end.max() <= high + 1e-9
    swing = np.abs(rows["path_swing"][figure])
    assert np.all(np.abs(rows["depth_base"][figure] - (low + high) / 2) <= (high - low) / 2 - swing)
    for number in range(1, 5):
        depth = (rows["depth_base"] + rows[f"waypoint_{number}_depth"])[~circles]
        assert low - 1e-9 <= depth.min() <= depth.max() <= high + 1e-9


def test_waypoints_are_drawn_inside_the_walls():
    walls = [-2.0, 2.5, -3.0, 2.0]
    share = {"helix": 0.0, "figure": 0.0}
    config = load_env_config({"tank": {"walls": walls}, "goal": {"path": {"share": share}}})
    rows = path_goal(config, np.random.default_rng(0).random((GOAL_DRAWS, 3000)))
    for number in range(1, 5):
        north, east = (rows[f"waypoint_{number}_{axis}"] for axis in ("north", "east"))
        room = np.minimum.reduce([north + 2.0, 2.5 - north, east + 3.0, 2.0 - east])
        assert room.min() >= WALL_MARGIN - 1e-9


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        ({"waypoints": [[0, 0, 0.4]]}, "2 to 32"),
        ({"waypoints": [[0, 0, 0.4]] * (MOST_WAYPOINTS + 1)}, "2 to 32"),
        ({"waypoints": "north"}, "2 to 32"),
        ({"waypoints": [[0, 0, 0.4], [0, 0, 0.6]]}, "straight up or down"),
        ({"waypoints": [[0, 0, 0.4], [1, np.nan, 0.6]]}, "finite"),
        ({"waypoints": [[0, 0, 0.4], [1, 0, 1.6]]}, "may swim from 0.05"),
        ({"kind": 3}, "follows from the task"),
        ({"path_radius": 0.0}, "at least 0.05 m"),
    ],
)
def test_what_is_no_path_is_refused(goal, message):
    with pytest.raises(ConfigError, match=message):
        RoboticFish3DEnv(task="path").reset(options={"goal": goal})


@pytest.mark.parametrize("goal", [{"north": 1.0}, {"waypoints": NORTH}, {"path_radius": 1.0}])
def test_other_tasks_have_no_paths(goal):
    with pytest.raises(ConfigError, match="path"):
        RoboticFish3DEnv(task="hold").reset(options={"goal": goal})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": {"share": {"helix": 0, "waypoints": 0, "figure": 0}}}, "not all zero"),
        ({"path": {"helix": {"radius": [0, 1]}}}, "helix.radius: positive"),
        ({"path": {"guidance": {"lookahead": 0}}}, "lookahead: positive"),
        ({"station": {"gain": 0}}, "gain: positive"),
        ({"station": {"distance": [1, 0]}}, "distance: a range"),
    ],
)
def test_settings_that_cannot_be_are_refused(change, message):
    with pytest.raises(ConfigError, match=message):
        load_env_config({"goal": change})


def test_many_waypoints_are_measured_and_left_behind():
    """The most that may be given, in a zigzag: progress ends at 1 with the last of them."""
    count = MOST_WAYPOINTS
    points = [[0.5 * k, 0.2 * (k % 2), 0.5] for k in range(count)]
    env = RoboticFish3DEnv(task="path", config={"goal": {"path": {"guidance": {"corner": 0.1}}}})
    env.reset(seed=0, options={"goal": {"waypoints": points}})
    still = np.array([0, -1, -1, 0, 0], np.float32)
    progress = []
    for start, end in pairwise(points):
        for share in np.linspace(0.05, 1, 10):
            env._batch.state[:2, 0] = (1 - share) * np.array(start[:2]) + share * np.array(end[:2])
            env._batch.state[7:13, 0] = 0.0
            progress.append(env.step(still)[4]["path_progress"])
    assert np.all(np.diff(progress) > -1e-9)
    assert progress[-1] == pytest.approx(1.0)


AGAINST = py_function(guidance.against_flow)


def test_a_place_is_kept_with_the_head_against_the_flow():
    """At the place: against the flow, at no speed over ground; downstream of it: ahead."""
    for towards in np.linspace(-3, 3, 5):
        flow = 0.04 * np.cos(towards), 0.04 * np.sin(towards)
        heading, speed = AGAINST(0.0, 0.0, 0.0, *flow, 0.1, 0.1)
        assert np.cos(heading - towards) == pytest.approx(-1.0)
        assert speed == 0.0
        # The place is 0.2 m against the flow, then 0.2 m with it.
        _, ahead = AGAINST(-5 * flow[0], -5 * flow[1], 0.0, *flow, 0.1, 0.1)
        heading, back = AGAINST(5 * flow[0], 5 * flow[1], 0.0, *flow, 0.1, 0.1)
        assert (ahead, back) == (pytest.approx(0.02), pytest.approx(-0.02))
        assert np.cos(heading - towards) == pytest.approx(-1.0)


def test_crabbing_makes_the_way_over_ground_good():
    """Water speed along the heading plus the flow goes where it should, to first order."""
    crab = py_function(guidance.crab)
    for wanted in np.linspace(-3, 3, 9):
        heading = crab(wanted, 0.01, -0.015, 0.1)
        north = 0.1 * np.cos(heading) + 0.01
        east = 0.1 * np.sin(heading) - 0.015
        assert np.sin(np.arctan2(east, north) - wanted) == pytest.approx(0.0, abs=1e-9)


def test_the_place_error_is_the_distance():
    env = RoboticFish3DEnv(task="station")
    state = {"position": [0.3, -0.2, 0.5], "euler": [0.0, 0.0, 0.0]}
    goal = {"north": 0.7, "east": -0.5, "depth": 0.62}
    _, info = env.reset(seed=0, options={"state": state, "goal": goal})
    assert info["place_error"] == pytest.approx(np.sqrt(0.4**2 + 0.3**2 + 0.12**2))
    assert info["goal_depth"] == 0.62


def test_a_flow_that_the_goal_names_is_believed():
    goal = {"north": 0.0, "east": 0.0, "depth": 0.5, "flow_north": 0.05}
    state = {"position": [0.0, 0.0, 0.5], "euler": [0.0, 0.0, 0.0]}
    env = RoboticFish3DEnv(task="station")
    _, info = env.reset(seed=0, options={"goal": goal, "state": state})
    assert np.cos(info["goal_heading"]) == pytest.approx(-1.0)


def test_guidance_to_a_place_knows_each_fishs_current():
    env = RoboticFish3DVectorEnv(
        5,
        task="station",
        randomization={
            "effects.current.north": [-0.06, -0.03],
            "effects.current.east": [0.0, 0.04],
        },
    )
    goal = {"north": 0.0, "east": 0.0, "depth": 0.5}
    state = {"position": [0.0, 0.0, 0.5], "euler": [0.0, 0.0, 0.0]}
    _, info = env.reset(seed=0, options={"goal": goal, "state": state})
    north, east = (info[f"parameter/effects.current.{axis}"] for axis in ("north", "east"))
    np.testing.assert_allclose(info["goal_heading"], np.arctan2(-east, -north), atol=1e-12)
    np.testing.assert_allclose(info["goal_speed"], 0.0, atol=1e-12)
