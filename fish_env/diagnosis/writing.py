"""Files of a diagnosis that runs and tables of steady motion share."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fish_env.params.io import save_fish
from fish_env.params.schema import FishParams

EXTENDING = ("cause", "parameters", "ambiguous")
"""Verdicts that come with an extended model."""


def write_answer(answer: Mapping[str, Any], extended: FishParams | None, folder: Path) -> None:
    """Writes ``diagnosis.json`` and, where there is one, the extended model as ``extended.yaml``.

    Args:
        answer: content of the first.
        extended: the extended model; without one, a file of an earlier diagnosis is removed, as it
            would contradict this one.
        folder: made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(answer, indent=1, allow_nan=False)
    (folder / "diagnosis.json").write_text(text + "\n", encoding="utf-8")
    file = folder / "extended.yaml"
    if extended is None:
        file.unlink(missing_ok=True)
    else:
        save_fish(extended, file)
