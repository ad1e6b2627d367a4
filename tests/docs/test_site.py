"""The site builds without a warning, and its pages fetch nothing from elsewhere."""

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
