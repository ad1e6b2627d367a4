"""The replay page in a browser: it swims when played, can be scrubbed, and complains of nothing.

Screenshots are kept in the folder ROBOFISH_SCREENSHOTS names, otherwise with the test's files.
"""

import pytest

from fish_env.params import load_fish
from fish_env.replay import Group, motion_from_channels, motion_from_trajectory, write_replay
from fish_env.simulator import InitialState, Simulator
from tests.replay.browser import Browser

pytestmark = pytest.mark.slow
FISH = load_fish("zheng-2021-a")
SWIM = [
    {"t": 0.0, "tail_amplitude": 0.5, "tail_frequency": 1.5},
    {"t": 4.0, "tail_offset": 0.4, "block_displacement": 0.006},
]
POSE = "Robofish.replays[0].stage.actors[0].fish.group.position.toArray()"
TAIL = "Robofish.replays[0].stage.actors[0].fish.tail.rotation.z"
TIME = "Robofish.replays[0].clock.time"
OVER = (
    "(({x, y, width, height}) => [x, y, width, height])"
    "(document.querySelector('.u-over').getBoundingClientRect())"
)
DRAWN = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    start = InitialState(position=(0.0, 0.0, 1.0))
    slow = Simulator(FISH, effects={"servo_lag": {"time_constant": 0.1}})
    truth = Simulator(FISH).run(SWIM, 10.0, start, rate_hz=50.0)
    lagged = slow.run(SWIM, 10.0, start, rate_hz=50.0)
    motions = (
        motion_from_trajectory(truth, "measured", "measured"),
        motion_from_trajectory(lagged, "baseline", "baseline"),
    )
    few = {name: truth.channels[name] for name in ("x", "y", "yaw")}
    camera = motion_from_channels(truth.time_s, few, "camera", "measured")
    groups = [Group("both", motions), Group("camera only", (camera,))]
    return write_replay(groups, FISH, tmp_path_factory.mktemp("page") / "replay.html")


@pytest.fixture
def opened(browser, page):
    """The page, just opened and paused at its start; afterwards nothing may have gone wrong."""
    browser.complaints.clear()
    browser.requests.clear()
    browser.open(page)
    browser.run("Robofish.replays[0].clock.play(false), Robofish.replays[0].clock.seek(0), 1")
    browser.run(DRAWN)
    yield browser
    assert browser.complaints == []
    assert {url.split(":")[0] for url in browser.requests} <= {"file", "data", "blob"}
    assert sum(url.startswith("file:") for url in browser.requests) == 1


def test_the_fish_swims_when_played(opened, pictures):
    before = opened.run(POSE)
    opened.press(" ")
    opened.wait_for(f"{TIME} > 2")
    opened.press(" ")
    assert opened.run("Robofish.replays[0].clock.playing") is False
    opened.run(DRAWN)
    assert opened.run(POSE)[0] > before[0] + 0.02
    opened.screenshot(pictures / "replay.png")
    stopped = opened.run(TIME)
    opened.run(DRAWN)
    assert opened.run(TIME) == stopped


def test_the_picture_changes_with_the_fish(opened, tmp_path):
    first = opened.screenshot(tmp_path / "first.png")
    assert opened.screenshot(tmp_path / "again.png") == first
    opened.run("Robofish.replays[0].clock.seek(5), 1")
    assert opened.screenshot(tmp_path / "later.png") != first


def test_it_plays_by_itself_and_the_tail_beats(browser, page):
    browser.open(page)
    browser.wait_for(f"{TIME} > 0.2")
    seen = set()
    for moment in (0.1, 0.2, 0.3, 0.4):
        browser.run(
            f"Robofish.replays[0].clock.play(false), Robofish.replays[0].clock.seek({moment}), 1"
        )
        browser.run(DRAWN)
        seen.add(round(browser.run(TAIL), 3))
    assert len(seen) == 4


def test_slider_and_plots_scrub(opened):
    opened.run(
        "(() => { const s = document.querySelector('input[type=range]'); s.value = 6;"
        " s.dispatchEvent(new Event('input')); })()"
    )
    assert opened.run(TIME) == pytest.approx(6.0)
    x, y, width, height = opened.run(OVER)
    opened.drag((x + 0.2 * width, y + height / 2), (x + 0.8 * width, y + height / 2))
    assert opened.run(TIME) == pytest.approx(8.0, abs=0.1)
    assert opened.run("document.querySelector('.rf-time').textContent").startswith("8.0")


def test_keys(opened):
    opened.press("End")
    assert opened.run(TIME) == pytest.approx(10.0)
    opened.press("ArrowLeft")
    assert opened.run(TIME) == pytest.approx(9.8)
    opened.press("Home")
    opened.press("ArrowRight")
    assert opened.run(TIME) == pytest.approx(0.2)
    opened.press("ArrowUp")
    assert opened.run("Robofish.replays[0].clock.speed") == 2
    opened.press("2")
    opened.run(DRAWN)
    assert opened.run("Robofish.replays[0].stage.actors[1].fish.group.visible") is False
    opened.press("v")
    assert opened.run("document.querySelectorAll('[aria-pressed=true]').length") == 1


def test_the_camera_is_dragged_and_zoomed(opened):
    place = "Robofish.replays[0].stage.camera.position.toArray()"
    distance = (
        "Robofish.replays[0].stage.camera.position"
        ".distanceTo(Robofish.replays[0].stage.controls.target)"
    )
    before, far = opened.run(place), opened.run(distance)
    opened.drag((300, 400), (420, 430))
    assert opened.run(place) != before
    assert opened.run(distance) == pytest.approx(far, rel=1e-3)
    opened.wheel((300, 400), -300)
    opened.wait_for(f"{distance} < {0.98 * far}")
    near = opened.run(distance)
    opened.press("-")
    assert opened.run(distance) > near


def test_a_change_of_colours_keeps_time_camera_and_what_is_hidden(opened):
    camera = "Robofish.replays[0].stage.camera.position.toArray()"
    opened.run("Robofish.replays[0].clock.seek(5), 1")
    opened.press("2")
    before = opened.run(camera)
    dark = {"name": "prefers-color-scheme", "value": "dark"}
    opened.call("Emulation.setEmulatedMedia", features=[dark])
    opened.run(DRAWN)
    assert opened.run(TIME) == pytest.approx(5.0)
    assert opened.run(camera) == pytest.approx(before)
    assert opened.run("Robofish.replays[0].tracks[1].shown") is False
    left, width = opened.run(
        "[document.querySelector('.rf-now').getBoundingClientRect().left -"
        " document.querySelector('.u-over').getBoundingClientRect().left,"
        " document.querySelector('.u-over').clientWidth]"
    )
    assert left == pytest.approx(0.5 * width, abs=3.0)


def test_nothing_covers_the_bar_when_everything_is_unfolded(opened):
    opened.run("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    opened.run(DRAWN)
    top, bottom = opened.run(
        "[document.querySelector('.rf-bar').getBoundingClientRect().top,"
        " document.querySelector('.rf-view').getBoundingClientRect().bottom]"
    )
    assert top >= bottom


def test_plots_fit_on_paper(opened):
    width = "document.querySelector('.uplot').getBoundingClientRect().width"
    on_screen = opened.run(width)
    opened.run("dispatchEvent(new Event('beforeprint')), 1")
    opened.run(DRAWN)
    assert opened.run(width) == 640 != on_screen
    opened.run("dispatchEvent(new Event('afterprint')), 1")
    opened.run(DRAWN)
    assert opened.run(width) == on_screen


def test_another_run_can_be_chosen(opened):
    opened.run(
        "(() => { const s = document.querySelector('.rf-run select'); s.value = 1;"
        " s.dispatchEvent(new Event('change')); })()"
    )
    assert opened.run("Robofish.replays[0].tracks.length") == 1
    assert "drawn as 0: z, roll, pitch" in opened.run(
        "document.querySelector('.rf-notes').textContent"
    )


@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_shows_everything_in_its_width(browser, page, pictures, dark):
    browser.open(page, 360, 740, dark)
    browser.run("Robofish.replays[0].clock.play(false), Robofish.replays[0].clock.seek(5), 1")
    assert browser.run("document.documentElement.scrollWidth") <= 360
    assert browser.run("document.querySelector('.rf-plot').getBoundingClientRect().right") <= 360
    smallest = (
        "Math.min(...[...document.querySelectorAll('.rf-replay button, .rf-replay select')]"
        ".filter(b => b.offsetParent).map(b => b.offsetHeight))"
    )
    assert browser.run(smallest) >= 40
    browser.screenshot(pictures / f"replay_phone_{'dark' if dark else 'light'}.png", whole=True)


def test_a_finger_turns_the_camera_and_moves_the_time(browser, page):
    browser.open(page, 360, 740)
    browser.run("Robofish.replays[0].clock.play(false), Robofish.replays[0].clock.seek(0), 1")
    place = "Robofish.replays[0].stage.camera.position.toArray()"
    before = browser.run(place)
    browser.swipe((180, 350), (240, 350))
    browser.run(DRAWN)
    assert browser.run(place) != before
    browser.run("document.querySelector('.u-over').scrollIntoView({block: 'center'})")
    x, y, width, height = browser.run(OVER)
    browser.swipe((x + 0.2 * width, y + height / 2), (x + 0.5 * width, y + height / 2))
    assert browser.run(TIME) > 1.5


def test_without_3d_the_plots_still_play(page, tmp_path):
    flat = Browser(tmp_path / "profile", "--disable-3d-apis")
    try:
        flat.open(page)
        flat.wait_for(f"{TIME} > 0.3")
        assert "WebGL is off" in flat.run("document.querySelector('.rf-sorry').textContent")
        assert flat.run("document.querySelectorAll('.rf-plot canvas').length") >= 4
    finally:
        flat.close()


def test_colours_follow_the_system(browser, page, pictures):
    ground = "getComputedStyle(document.body).backgroundColor"
    browser.open(page, dark=True)
    dark = browser.run(ground)
    browser.run("Robofish.replays[0].clock.play(false), Robofish.replays[0].clock.seek(7), 1")
    browser.screenshot(pictures / "replay_dark.png")
    browser.open(page)
    assert browser.run(ground) != dark


def test_errors_would_be_noticed(browser, tmp_path):
    file = tmp_path / "broken.html"
    file.write_text(
        "<script src='https://example.invalid/x.js'></script><script>nothing()</script>"
    )
    browser.complaints.clear()
    browser.requests.clear()
    browser.open(file)
    browser.wait_for("true")
    assert any("nothing" in text for text in browser.complaints)
    assert any("example.invalid" in url for url in browser.requests)
