"""`robofish demo` runs its parts in order, names the hidden fault and every file it wrote."""

import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from fish_env.commands import demo


def first(console: Console, out: Path) -> list[Path]:
    """Never called by this title."""
    console.print("one")
    return [out / "first.png"]


def second(console: Console, out: Path) -> list[Path]:
    """A part of somebody else's.

    What follows the first line is not its title.
    """
    console.print("two")
    return [out / "second.png"]


def test_parts_of_other_packages_come_after_its_own(monkeypatch, tmp_path, capsys):
    entry = SimpleNamespace(name="second", load=lambda: second)
    monkeypatch.setattr(demo, "entry_points", lambda group: [entry] if group == demo.GROUP else [])
    monkeypatch.setattr(demo, "PARTS", {"The first part": first})
    demo.run_demo(Console(), tmp_path)
    shown = capsys.readouterr().out
    order = ["1 of 2: The first part", "one", "2 of 2: A part of somebody else's", "two"]
    places = [shown.index(text) for text in [*order, "Open these files"]]
    assert places == sorted(places)
    assert "What follows" not in shown
    for name in ("first.png", "second.png"):
        assert str(tmp_path / name) in shown.replace("\n", "")


@pytest.mark.slow
def test_the_demonstration_finds_the_hidden_fault(tmp_path, capsys):
    report, picture = demo.diagnose_trials(Console(width=200), tmp_path)
    shown = capsys.readouterr().out
    assert re.search(r"The simulation lacks servo_lag \(time constant 0\.040\d s\)\.", shown)
    assert "closes 100 % of the gap" in shown
    assert "Next: " in shown
    assert "The simulation lacks servo_lag" in report.read_text(encoding="utf-8")
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_the_report_leads_the_demonstration():
    assert next(iter(demo.PARTS.values())) is demo.diagnose_trials
