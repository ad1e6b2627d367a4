"""What goes into the page: sizes, colours, and numbers that come back as they were."""

import base64
import json
import re

import numpy as np
import pytest

from fish_env.params import load_fish
from fish_env.replay import Group, motion_from_channels, motion_from_trajectory, write_replay
from fish_env.replay.packing import COLOURS, colours_of, page_data
from fish_env.replay.page import STATIC, component
from fish_env.simulator import Simulator

FISH = load_fish("zheng-2021-a")
SWIM = [{"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 1.5}]


def motion(role="other", seconds=2.0, name="fish"):
    trajectory = Simulator(FISH).run(SWIM, seconds, rate_hz=50.0)
    return motion_from_trajectory(trajectory, name, role)


def floats(text):
    return np.frombuffer(base64.b64decode(text), "<f4")


def test_numbers_come_back_from_the_page():
    moved = motion()
    track = page_data([Group("one", (moved,))], FISH)["groups"][0]["tracks"][0]
    position = floats(track["position"]).reshape(-1, 3)
    assert position == pytest.approx(moved.frames.position, abs=1e-6)
    assert floats(track["channels"]["yaw"]) == pytest.approx(
        np.degrees(moved.channels["yaw"]), abs=1e-3
    )


def test_every_motion_has_a_colour_of_its_own():
    roles = ("measured", "baseline", "extended", "other", "other", "baseline")
    motions = [motion(role, 0.5) for role in roles]
    colours = colours_of(motions)
    assert len(set(colours)) == len(roles)
    assert colours[:3] == [COLOURS[role] for role in roles[:3]]


def test_the_block_moves_aft_with_its_displacement():
    aft = [{**SWIM[0], "block_displacement": 0.005}]
    blocks = []
    for rows in (SWIM, aft):
        swim = motion_from_trajectory(Simulator(FISH).run(rows, 1.0, rate_hz=50.0), "fish")
        track = page_data([Group("one", (swim,))], FISH)["groups"][0]["tracks"][0]
        blocks.append(floats(track["block"]).reshape(-1, 4)[-1])
    assert blocks[1] - blocks[0] == pytest.approx([-0.005, 0.0, 0.0, 0.0], abs=1e-7)


def test_channels_that_all_motions_have_are_plotted_first():
    swim = motion(name="simulated")
    few = {name: swim.channels[name] for name in ("x", "y", "yaw")}
    camera = motion_from_channels(swim.time_s, few, "camera", "measured")
    plots = page_data([Group("both", (camera, swim))], FISH)["groups"][0]["plots"]
    assert [plot["channel"] for plot in plots if plot["shown"]] == ["yaw", "x", "y"]
    assert {plot["channel"] for plot in plots} > {"z", "speed", "r"}
    alone = page_data([Group("one", (swim,))], FISH)["groups"][0]["plots"]
    shown = {plot["channel"] for plot in alone if plot["shown"]}
    assert shown == {"z", "speed", "yaw", "pitch", "roll"}


def test_a_minute_of_three_fish_stays_below_six_megabytes(tmp_path):
    motions = tuple(motion(role, 60.0) for role in ("measured", "baseline", "extended"))
    page = write_replay([Group("one", motions)], FISH, tmp_path / "page.html")
    assert page.stat().st_size < 3e6


def test_the_page_asks_for_nothing_and_keeps_the_licences(tmp_path):
    page = write_replay([Group("one", (motion(),))], FISH, tmp_path / "page.html", "<b> & co")
    text = page.read_text()
    assert not re.search(r"""(src|href)=["'](?!data:)""", text)
    assert not re.search(r"url\((?!['\"]?(data:|#))|@import|\bfetch\(['\"]http", text)
    assert "three.js authors" in text
    assert "Leon Sorokin" in text
    assert "&lt;b&gt; &amp; co" in text
    versions = (STATIC / "vendor" / "README.md").read_text()
    assert "three.js" in versions
    assert "uPlot" in versions


def test_a_name_cannot_break_out_of_the_data():
    name = "</script><script>alert(1)</script>"
    text = component([Group(name, (motion(name=name),))], FISH)
    assert text.count("<script") == 1
    data = re.search(r'application/json"[^>]*>(.*)</script>', text, re.DOTALL)
    assert json.loads(data.group(1))["groups"][0]["name"] == name


def test_every_part_of_three_that_is_used_is_joined_into_its_file():
    used = {
        name
        for script in STATIC.glob("*.js")
        for name in re.findall(r"THREE\.(\w+)", script.read_text())
    }
    parts = (STATIC / "vendor" / "three-parts.js").read_text()
    named = set(re.findall(r"\w+", " ".join(re.findall(r"\{(.*?)\}", parts, re.DOTALL))))
    assert used == named
