"""The report in a browser: the fish swims, nothing is complained of, small screens work."""

import pytest

from fish_env.diagnosis.report import write_report
from tests.diagnosis.report_cases import answer, run_series, steady_series

pytestmark = pytest.mark.slow
POSE = "Robofish.replays[0].stage.actors[0].fish.group.position.toArray()"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return write_report(answer(), run_series(), tmp_path_factory.mktemp("report"))


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (1280, True), (360, False)])
def test_the_report_opens_and_the_fish_swims(browser, page, pictures, width, dark):
    browser.complaints.clear()
    browser.requests.clear()
    browser.open(page, width, 800, dark)
    assert browser.run("Robofish.replays[0].clock.playing") is False
    browser.run("document.querySelector('.rf-replay').focus()")
    before = browser.run(POSE)
    browser.press(" ")
    browser.wait_for("Robofish.replays[0].clock.time > 1.5")
    browser.press(" ")
    assert browser.run(POSE) != before
    assert browser.run("document.documentElement.scrollWidth") <= width
    browser.screenshot(pictures / f"report_{width}{'_dark' if dark else ''}.png", whole=True)
    assert browser.complaints == []
    assert {url.split(":")[0] for url in browser.requests} <= {"file", "data", "blob"}
    assert sum(url.startswith("file:") for url in browser.requests) == 1


def test_keys_outside_the_replay_belong_to_the_page(browser, page):
    browser.open(page)
    browser.run("document.activeElement.blur()")
    browser.press("ArrowRight")
    assert browser.run("Robofish.replays[0].clock.time") == 0


def test_words_of_drawings_are_read_in_the_dark(browser, page):
    browser.open(page, dark=True)
    fill = browser.run("getComputedStyle(document.querySelector('figure svg text')).fill")
    red, green, blue = (int(v) for v in fill.removeprefix("rgb(").removesuffix(")").split(","))
    assert min(red, green, blue) > 180


def test_a_steady_report_opens(browser, tmp_path, pictures):
    browser.complaints.clear()
    browser.open(write_report(answer(), steady_series(), tmp_path))
    browser.screenshot(pictures / "report_steady.png", whole=True)
    assert browser.complaints == []
