"""Generated pages are up to date, links lead somewhere, and the tables say what the code does."""

import inspect
import json
import re
from pathlib import Path

import pytest
from typer.main import get_command

from fish_env.cli import app
from fish_env.effects import catalogue
from fish_env.envs.robotic_fish_3d import RoboticFish3DEnv
from scripts import (
    make_benchmarks_page,
    make_effects_page,
    make_environment_page,
    update_readme,
)
from tests.docs.pages import PAGES, ROOT

REMEDY = "run `make docs`"
EXAMPLES = ("examples/my-fish.yaml", "examples/cable_drag.py", "examples/rover.py")


GENERATED = [make_benchmarks_page, make_effects_page, make_environment_page]


@pytest.mark.parametrize("module", GENERATED)
def test_a_generated_page_is_up_to_date(module):
    assert module.PAGE.read_text(encoding="utf-8") == module.page(), REMEDY


def test_the_generated_parts_of_the_readme_are_up_to_date():
    text = update_readme.README.read_text(encoding="utf-8")
    assert text == update_readme.updated(text, update_readme.BLOCKS), REMEDY


def test_the_benchmarks_page_takes_the_latest_reports(tmp_path):
    for name, text in (
        ("speed-2026-01-02-10", "Tenth"),
        ("speed-2026-01-02-2", "Second"),
        ("speed-2026-01-02", "# New\n\n## Judged\n- met"),
        ("speed-2026-01-01", "Old"),
    ):
        (tmp_path / f"{name}.md").write_text(text)
    page = make_benchmarks_page.page(tmp_path, tmp_path)
    assert "### New\n\n#### Judged\n\n- met\n\nSecond\n\nTenth\n" in page
    assert "Old" not in page
    assert "No full run is published yet." in page


def test_parts_of_a_suite_are_summed_up_as_one(tmp_path):
    row = {"tier": "suspects", "truth": "outliers", "verdict": "no_misfit", "told": True}
    blank = {"named": [], "claimed": [], "false_names": [], "alternatives": []}
    for part, commit in (("", "abc"), ("-2", "def")):
        file = tmp_path / f"realistic-2026-01-02{part}"
        rows = [{**row, **blank, "strength": 1.0, "seed": len(part)}]
        content = {"date": "2026-01-02", "commit": commit, "rows": rows}
        file.with_suffix(".json").write_text(json.dumps(content))
        file.with_suffix(".md").write_text(f"# Part{part}")
    page = make_benchmarks_page.page(tmp_path, tmp_path)
    assert "2 cases, each diagnosed once: 1 at abc, 1 at def." in page
    assert "| suspect named or told by `inputs` | 100 % (16-100), 2/2 |" in page
    assert "# Part" not in page


def test_every_effect_has_an_entry_with_its_parameters():
    page = make_effects_page.page()
    for name, effect in catalogue().items():
        entry = page.split(f"### {name}\n")[1].split("\n### ")[0]
        for parameter in effect.parameters:
            assert f"| `{parameter.name}` | {parameter.unit} |" in entry
        assert effect.equation in entry


def test_every_option_of_the_environment_is_on_its_page():
    table = make_environment_page.page().split("## Options")[1].split("## Many fish")[0]
    options = list(inspect.signature(RoboticFish3DEnv).parameters)
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == options


def test_a_formula_on_the_environments_page_is_no_list():
    """A line that begins with a minus sign would start one."""
    lines = make_environment_page.page().partition("## Settings")[0].splitlines()
    assert [line for line in lines if line.startswith(("- ", "+ "))] == []


@pytest.mark.parametrize("example", EXAMPLES)
def test_the_examples_on_a_page_are_the_files(example):
    page = (ROOT / "docs" / "your-own.md").read_text(encoding="utf-8")
    shown = re.search(rf"<!-- {example} -->\n```\w+\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert shown is not None
    assert shown[1] == (ROOT / example).read_text(encoding="utf-8"), "copy the file into the page"


def test_every_command_is_on_the_first_page():
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\| `robofish (\w+)", page, re.MULTILINE))
    assert named == set(get_command(app).commands)  # type: ignore[attr-defined]


def test_every_page_is_in_the_navigation():
    """Also without the site's builder, which would only mention it."""
    named = re.findall(r"(\w[\w-]*\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    pages = [page.name for page in PAGES if page.name != "README.md"]
    assert sorted(named) == sorted(pages), "each belongs once into nav in mkdocs.yml"


def links(page: Path) -> list[str]:
    """Targets inside the project that a page points to."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"\]\(([^)\s]+)\)|src=\"([^\"]+)\"", text)
    targets = [first or second for first, second in found]
    return [target for target in targets if not target.startswith("http")]


def anchors(page: Path) -> set[str]:
    """Names of the headings of a page, as in links."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def is_broken(link: str, page: Path) -> bool:
    """Whether a link leads nowhere."""
    name, _, anchor = link.partition("#")
    target = page.parent / name if name else page
    return not target.exists() or bool(anchor and anchor not in anchors(target))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    assert [link for link in links(page) if is_broken(link, page)] == []


def test_the_link_check_notices_a_dead_one():
    page = ROOT / "docs" / "model.md"
    assert is_broken("nowhere.md", page)
    assert is_broken("effects.md#no_such_effect", page)
    assert not is_broken("effects.md#servo_lag", page)


def test_a_block_is_written_anew_and_the_rest_is_kept():
    text = "a\n<!-- x -->\nold\n<!-- end of x -->\nb\n"
    assert update_readme.updated(text, {"x": lambda: r"new \1"}) == (
        "a\n<!-- x -->\n\nnew \\1\n\n<!-- end of x -->\nb\n"
    )
    with pytest.raises(ValueError, match="no block 'y'"):
        update_readme.updated(text, {"y": lambda: ""})


def test_the_speed_headline_takes_the_latest_measurement(tmp_path):
    spread = {"median": 5.25, "low": 5.0, "high": 5.5}
    row = {"name": "RoboticFish3D-v0, gym.make", "envs": 1, "threads": 1}
    record = {
        "date": "2026-01-02",
        "machine": {"cpu": "a CPU", "cores": 2},
        "measured": [
            row | {"env_steps_per_s": spread | {"median": 120_000.0}},
            row | {"envs": 64, "threads": 2, "env_steps_per_s": spread | {"median": 2e6}},
            row | {"name": "theirs", "env_steps_per_s": spread},
        ],
        "verdicts": [
            {"claim": "one", "against": "p", "target": 4.0, "ratio": spread, "verdict": "met"},
            {"claim": "two", "against": "p", "target": 6.0, "ratio": None, "verdict": "-"},
        ],
    }
    (tmp_path / "speed-2026-01-01.json").write_text("{}")
    (tmp_path / "speed-2026-01-02.json").write_text(json.dumps(record))
    lines = update_readme.speed(tmp_path)
    assert "* Speed, in control steps of 0.1 s (2 cores of a CPU, 2026-01-02):" in lines
    assert "    * 120k/s for 1 fish on 1 thread\n    * 2M/s for 64 fish on 2 threads\n" in lines
    assert "* One: at least 4 times as fast (target); measured 5.2 times: met." in lines
    assert "* Two: at least 6 times as fast (target); not measured." in lines
    assert "not measured" in update_readme.speed(tmp_path / "none")


def test_the_headline_of_the_diagnosis_gives_rates_with_intervals(tmp_path):
    rate = {"count": 9, "of": 10, "rate": 0.9, "low": 0.555, "high": 0.997}
    overall = {"name_right": rate, "wrong_single": rate | {"count": 0}, "false_alarm": None}
    record = {"date": "2026-01-02", "cases": 10, "overall": overall}
    (tmp_path / "diagnosis-2026-01-02.json").write_text(json.dumps(record))
    (tmp_path / "diagnosis-quick-2026-01-03.json").write_text("{}")
    assert update_readme.diagnosis(tmp_path) == (
        "* Diagnosis of 10 hidden cases, 2026-01-02:\n"
        "    * verdict and name right in 9 of 10 (56 to 100 %)\n"
        "    * a wrong single name in 0 of 10 (56 to 100 %)"
    )
    assert "no full run" in update_readme.diagnosis(tmp_path / "none")
