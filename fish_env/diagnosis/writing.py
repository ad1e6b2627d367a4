"""Files of a diagnosis that runs and tables of steady motion share."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fish_env.diagnosis.headline import EXPERIMENT_FILE
from fish_env.diagnosis.written import replace_part
from fish_env.files import write_text
from fish_env.params.io import fish_outputs, save_fish
from fish_env.params.schema import FishParams

EXTENDED = "extended.yaml"


def outputs(fish: FishParams, folder: Path) -> list[Path]:
    """The files that a diagnosis of a fish writes into a folder, beside its figures.

    Args:
        fish: the fish; the extended one has the same tables.
        folder: where they go.
    """
    names = ("diagnosis.json", "report.html", EXPERIMENT_FILE)
    return [*(folder / name for name in names), *fish_outputs(fish, folder / EXTENDED).values()]


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
    write_text(folder / "diagnosis.json", text + "\n")
    written = [] if extended is None else save_fish(extended, folder / EXTENDED)
    replace_part(folder, "extended model", written)
