"""Stand-ins for the diagnosis, to try the benchmark and the scorer without it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.hidden.truth import Truth


def silent(folder: str | Path, seed: int = 0, quick: bool = False) -> dict:
    """Never sees anything."""
    return {"verdict": "no_misfit", "causes": [], "alternatives": [], "runtime_s": 0.0}


def all_knowing(folder: str | Path, seed: int = 0, quick: bool = False) -> dict:
    """Reads the answer that is kept beside the folder, and gives it with narrow intervals."""
    target = Path(folder)
    return perfect(Truth.load(target.parent / f"{target.name}.truth.json"))


def perfect(truth: Truth) -> dict[str, Any]:
    """The right answer to a case, in the form of diagnosis.json."""
    causes: list[dict[str, Any]] = [
        {
            "name": name,
            "parameters": {
                key: {"estimate": value, "ci95": [value - 1e-9, value + 1e-9], "unit": ""}
                for key, value in values.items()
            },
        }
        for name, values in truth.effects.items()
    ]
    causes += [{"name": f"parameter:{path}"} for path in truth.moved]
    verdict = truth.verdicts[0]
    return {
        "verdict": verdict,
        "causes": causes if verdict in ("cause", "parameters") else [],
        "alternatives": [],
        "parameters": [
            {"name": f"parameter:{path}", "estimate": value, "ci95": [value - 1e-9, value + 1e-9]}
            for path, value in truth.coefficients.items()
        ],
        "gain": {"share_of_reachable": {"estimate": 1.0, "ci95": [1.0, 1.0]}},
        "preconditions": [{"name": name, "excited": truth.visible} for name in truth.effects],
        "runtime_s": 0.0,
    }
