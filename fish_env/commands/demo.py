"""`robofish demo`: what the package does, in a minute or two. Each part is one function.

Parts that build on this package add themselves as entry points of the group ``robofish.demo``:
functions like those of :data:`PARTS`, whose docstring begins with their title.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

from rich.console import Console
from rich.rule import Rule

from fish_env.commands.numbers import write_json
from fish_env.comparison import compare_steady
from fish_env.comparison.words import in_words
from fish_env.data import SteadyDataset, load_dataset
from fish_env.errors import DatasetError
from fish_env.files import check_outputs
from fish_env.params import load_fish

DATASET = "msu-steady"
TRIALS = "demo-trials"
ANSWER = Path("diagnosis", "diagnosis.json")
"""What the diagnosis writes below the folder of the demonstration."""
Part = Callable[[Console, Path], list[Path]]


def compare_with_a_real_fish(console: Console, out: Path) -> list[Path]:
    """Compares a real fish's steady swimming with its simulation; returns the pictures."""
    from fish_env.plotting.comparison import draw_steady

    measured = load_dataset(DATASET)
    if not isinstance(measured, SteadyDataset):
        raise DatasetError(f"{DATASET}: the demonstration needs the shipped table; reinstall")
    with console.status(f"simulating {len(measured.ids)} swims (the first time: compiling)"):
        comparison = compare_steady(measured, load_fish(measured.fish))
    console.print(
        f"{len(measured.ids)} swims of a real robotic fish, compared with a simulation whose "
        "parameters were not fitted to them:"
    )
    for sentence in in_words(comparison):
        console.print(f"• {sentence}", highlight=False)
    with console.status("drawing"):
        return draw_steady(comparison, out)


def diagnose_trials(console: Console, out: Path) -> list[Path]:
    """Diagnoses six runs of a robot with a hidden fault; returns the report and its picture."""
    from fish_env.commands.diagnose import print_headline
    from fish_env.diagnosis.pipeline import diagnose

    console.print(
        "Six runs of 10 s of a simulated robot, with sensor noise. It has one fault that the model "
        "does not include. The diagnosis searches for it."
    )
    folder = out / ANSWER.parent
    with console.status("reading") as status:
        answer = diagnose(
            TRIALS, folder, quick=True, progress=lambda step: status.update(f"{step}")
        )
    print_headline(console, answer)
    return [folder / "report.html", folder / "figures" / "paths.png"]


GROUP = "robofish.demo"
PARTS: dict[str, Part] = {
    "Diagnosis of a simulated robot": diagnose_trials,
    "A real fish and its simulation": compare_with_a_real_fish,
}
"""Title -> what is done, in this order."""


def all_parts() -> dict[str, Part]:
    """The parts of this package, then those that installed packages add."""
    added = [entry.load() for entry in sorted(entry_points(group=GROUP), key=lambda e: e.name)]
    return PARTS | {part.__doc__.partition("\n")[0].rstrip("."): part for part in added}


def run_demo(console: Console, out: Path, json_file: Path | None = None) -> None:
    """Runs every part of the demonstration and names the report and the pictures it wrote.

    Args:
        console: Where words and progress go.
        out: Folder for the report and the pictures.
        json_file: JSON file for the diagnosis and the names of the files; None for none.
    """
    check_outputs([json_file, out / ANSWER])
    begun, pictures, parts = time.monotonic(), list[Path](), all_parts()
    for number, (title, part) in enumerate(parts.items(), 1):
        console.print(Rule(f"{number} of {len(parts)}: {title}", align="left"))
        pictures += part(console, out)
    console.print(Rule("Open these files", align="left"))
    for picture in pictures:
        console.print(str(picture), soft_wrap=True)
    if json_file is not None:
        found = json.loads((out / ANSWER).read_text(encoding="utf-8"))
        write_json(console, json_file, {"diagnosis": found, "files": [str(p) for p in pictures]})
    console.print(f"{time.monotonic() - begun:.0f} s", style="dim")
