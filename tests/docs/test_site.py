"""The site builds without a warning, fetches nothing from elsewhere, and works in opened files."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tests.docs.pages import ROOT

LOADED = {("script", "src"), ("link", "href"), ("img", "src"), ("iframe", "src"), ("source", "src")}


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The site, built afresh; a warning of mkdocs fails it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-d", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


class Loaded(HTMLParser):
    """Addresses that a page loads by itself, which a link is not."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "link" and given.get("rel") in ("canonical", "next", "prev"):
            return
        self.addresses += [given[key] or "" for t, key in LOADED if t == tag and key in given]


def fetched(page: Path) -> list[str]:
    """What a page loads that does not lie beside it."""
    addresses = Loaded(page.read_text(encoding="utf-8")).addresses
    inside = [page.parent / address.partition("?")[0].partition("#")[0] for address in addresses]
    return [a for a, file in zip(addresses, inside, strict=True) if not file.is_file()]


def test_pages_load_only_what_lies_beside_them(site):
    pages = [page for page in site.rglob("*.html") if page.name != "404.html"]
    assert len(pages) > 10
    assert {page.name: fetched(page) for page in pages if fetched(page)} == {}


def test_styles_load_only_what_lies_beside_them(site):
    for style in site.rglob("*.css"):
        found = re.findall(r"url\(([^)]+)\)", style.read_text(encoding="utf-8"))
        files = [url.strip("\"'") for url in found]
        outside = [f for f in files if not f.startswith(("data:", "#"))]
        assert [f for f in outside if not (style.parent / f.partition("#")[0]).is_file()] == []


def test_the_check_notices_what_would_be_fetched(tmp_path):
    page = tmp_path / "page.html"
    page.write_text(
        '<a href="https://a.example"></a><script src="https://b.example/x.js"></script>'
    )
    assert fetched(page) == ["https://b.example/x.js"]


def test_search_works_in_opened_files(site):
    """The index lies there as a script, and the worker is replaced by a frame."""
    assert (
        (site / "search" / "search_index.js").read_text(encoding="utf-8").startswith("var __index")
    )
    assert "iframe-worker.js" in (site / "index.html").read_text(encoding="utf-8")


def test_formulas_are_left_to_katex(site):
    page = (site / "model.html").read_text(encoding="utf-8")
    assert page.count('class="arithmatex"') > 30
    assert "katex.min.js" in page
    assert "```math" not in page


def test_docstrings_leave_no_roles_of_sphinx(site):
    page = (site / "api.html").read_text(encoding="utf-8")
    assert re.findall(r":(?:class|func|mod|meth):", page) == []


def pages_of(site: Path) -> list[Path]:
    return sorted(page for page in site.glob("*.html") if page.name != "404.html")


@pytest.mark.slow
def test_every_page_opens_without_a_complaint_or_a_request(site, browser):
    browser.complaints.clear()
    browser.requests.clear()
    for page in pages_of(site):
        browser.open(page)
        assert browser.complaints == [], page.name
    assert {url.partition(":")[0] for url in browser.requests} <= {"file", "data", "blob"}


UNDRAWN = (
    "[...document.querySelectorAll('.arithmatex')].filter(e => !e.querySelector('.katex')).length"
)


@pytest.mark.slow
@pytest.mark.parametrize("page", ["model.html", "diagnosis.html"])
def test_every_formula_is_drawn(page, site, browser):
    browser.open(site / page)
    assert browser.run("document.querySelectorAll('.katex').length") > 0
    assert browser.run(UNDRAWN) == 0


@pytest.mark.slow
def test_a_formula_that_cannot_be_drawn_is_noticed(site, browser):
    broken = site / "broken-formula.html"
    text = (site / "model.html").read_text(encoding="utf-8")
    broken.write_text(text.replace("\\(C\\)", "\\(\\frac{\\)"), encoding="utf-8")
    browser.complaints.clear()
    browser.open(broken)
    assert browser.run(UNDRAWN) > 0
    assert any("ParseError" in complaint for complaint in browser.complaints)
    broken.unlink()


@pytest.mark.slow
def test_search_finds_an_effect_by_a_part_of_its_name(site, browser):
    browser.open(site / "index.html")
    field = "document.querySelector('.md-search__input')"
    browser.run(f"{field}.focus(), {field}.value = 'backlash'")
    browser.run(
        f"{field}.dispatchEvent(new KeyboardEvent('keyup', {{key: 'h', bubbles: true}})), 1"
    )
    browser.wait_for("document.querySelectorAll('.md-search-result__item').length > 0")
    assert "servo_" in browser.run("document.querySelector('.md-search-result__list').innerText")


@pytest.mark.slow
def test_no_page_is_wider_than_a_phone(site, browser):
    wide = []
    for page in pages_of(site):
        browser.open(page, width=390, height=800)
        if browser.run("document.documentElement.scrollWidth") > 390:
            wide.append(page.name)
    assert wide == []
