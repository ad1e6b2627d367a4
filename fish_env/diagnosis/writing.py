"""Files of a diagnosis that runs and tables of steady motion share."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fish_env.diagnosis.entries import FORMAT
from fish_env.diagnosis.headline import EXPERIMENT_FILE
from fish_env.diagnosis.written import replace_part
from fish_env.files import check_chosen, check_no_links, check_outputs, write_text
from fish_env.params.io import check_tables, fish_outputs, save_fish
from fish_env.params.schema import FishParams
from fish_env.version import PROGRAM

ANSWER, REPORT, EXTENDED = "diagnosis.json", "report.html", "extended.yaml"
FIGURES = "figures"
MARKS = {
    ANSWER: f'"format": "{FORMAT.split("/")[0]}/',
    REPORT: PROGRAM,
    EXTENDED: PROGRAM,
    EXPERIMENT_FILE: "t,",
}
"""File of a diagnosis -> what stands near its beginning, of whichever version."""
FIGURE = re.compile(
    r"(paths|budget|regimes|ranking|confusability|misfit|gain|next_experiment|steady|run_.*)"
    r"\.(svg|png)"
)
"""Names of figures."""


def outputs(fish: FishParams, folder: Path) -> list[Path]:
    """The files that a diagnosis of a fish writes into a folder, beside its figures.

    Args:
        fish: the fish; the extended one has the same tables.
        folder: where they go.
    """
    names = (ANSWER, REPORT, EXPERIMENT_FILE)
    return [*(folder / name for name in names), *fish_outputs(fish, folder / EXTENDED).values()]


def check_own(fish: FishParams, folder: Path) -> None:
    """Refuses a folder in which a diagnosis would replace what no diagnosis wrote.

    Args:
        fish: the fish, see :func:`outputs`.
        folder: where the diagnosis will be written.

    Raises:
        OutputError: names a link, or a file of the user with the name of one of a diagnosis.
    """
    check_no_links(outputs(fish, folder))
    check_tables(fish, folder / EXTENDED)
    check_marks(folder / name for name in MARKS)
    check_marks(sorted((folder / FIGURES).glob("*")))
    check_outputs([folder / FIGURES / "paths.svg"])


def check_marks(files: Iterable[Path]) -> None:
    """Refuses files with names of a diagnosis that no diagnosis wrote, or that are links.

    Args:
        files: files that need not be there; others in their folders are passed over.

    Raises:
        OutputError: names a file.
    """
    for file in files:
        mark = PROGRAM if FIGURE.fullmatch(file.name) else MARKS.get(file.name)
        if mark is not None:
            check_chosen([file], mark)


def write_answer(answer: Mapping[str, Any], extended: FishParams | None, folder: Path) -> None:
    """Writes ``diagnosis.json`` and, where there is one, the extended model as ``extended.yaml``.

    Args:
        answer: content of the first.
        extended: the extended model; without one, that of an earlier diagnosis is removed, as it
            would contradict this one. A file that no diagnosis wrote stays.
        folder: made if it is not there.

    Raises:
        OutputError: a file cannot be written.
    """
    text = json.dumps(answer, indent=1, allow_nan=False)
    write_text(folder / ANSWER, text + "\n")
    written = [] if extended is None else save_fish(extended, folder / EXTENDED)
    replace_part(folder, "extended model", written)
