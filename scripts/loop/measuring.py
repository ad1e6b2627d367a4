"""A hidden fish is measured and diagnosed; what the designer then knows, and what is true."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fish_env.params import FishParams, load_fish, save_fish
from scripts.loop.declaration import Declaration, HiddenFish
from scripts.results import commit
from tests.hidden.cases import make_case
from tests.hidden.suite import PIPELINE, find
from tests.hidden.truth import Truth

SHOWN = ("verdict", "causes", "alternatives", "unexplained", "runtime_s")
"""What of a diagnosis goes into the results."""


@dataclass(frozen=True)
class Known:
    """One fish after its diagnosis.

    Attributes:
        name: of the hidden fish.
        truth: what was hidden.
        true: parameter file of the hidden fish.
        extended: what the diagnosis wrote; None where it wrote no extended model.
        about: verdict, causes, commit and processor time of the diagnosis.
    """

    name: str
    truth: Truth
    true: Path
    extended: Path | None
    about: Mapping[str, Any]


def measure_and_diagnose(
    declared: Declaration, hidden: HiddenFish, folder: Path, diagnose: str = PIPELINE
) -> Known:
    """Measures and diagnoses a hidden fish, or reads back what an earlier call left.

    Args:
        declared: the comparison.
        hidden: one of its fish.
        folder: gets ``runs``, ``runs.truth.json``, ``true.yaml`` and ``diagnosis``.
        diagnose: "module:function" with the arguments of
            :func:`fish_env.diagnosis.pipeline.diagnose`.
    """
    finished = folder / "about.json"
    if not finished.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        begun = time.process_time()
        truth = make_case(declared.tier, hidden.seed, folder / "runs", hidden.effects)
        save_fish(true_fish(truth), folder / "true.yaml")
        answer = find(diagnose)(folder / "runs", folder / "diagnosis", seed=hidden.seed)
        about = {key: answer.get(key) for key in SHOWN}
        about |= {"commit": commit(), "cpu_s": round(time.process_time() - begun, 1)}
        finished.write_text(json.dumps(about, indent=1), encoding="utf-8")
    extended = folder / "diagnosis" / "extended.yaml"
    return Known(
        hidden.name,
        Truth.load(folder / "runs.truth.json"),
        folder / "true.yaml",
        extended if extended.is_file() else None,
        json.loads(finished.read_text(encoding="utf-8")),
    )


def true_fish(truth: Truth) -> FishParams:
    """The hidden fish as the environment swims it."""
    fish = load_fish(truth.fish).replace(truth.coefficients)
    return replace(fish, name="hidden", effects=truth.effects)
