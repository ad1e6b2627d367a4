"""`robofish demo` runs its parts in order and names every picture."""

from pathlib import Path
from types import SimpleNamespace

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
    places = [shown.index(text) for text in [*order, "Pictures"]]
    assert places == sorted(places)
    assert "What follows" not in shown
    for name in ("first.png", "second.png"):
        assert str(tmp_path / name) in shown.replace("\n", "")
