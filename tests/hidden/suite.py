"""Which cases a suite holds, and how one of them is made, diagnosed and scored."""

from __future__ import annotations

import importlib
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from scripts.results import kept
from tests.hidden.cases import make_case
from tests.hidden.plans import PLANS
from tests.hidden.scoring import Row, failed, score

Diagnose = Callable[..., Mapping[str, Any]]
PIPELINE = "fish_env.diagnosis.pipeline:diagnose"
FULL = {
    "rich": len(PLANS["rich"].choices),
    "small": len(PLANS["small"].choices),
    "null": 30,
    "null_strong": 12,
    "camera": 16,
    "null_camera": 4,
    "closed_loop": 12,
    "null_closed_loop": 4,
    "pairs": len(PLANS["pairs"].choices),
    "triples": len(PLANS["triples"].choices),
    "outside": len(PLANS["outside"].choices),
    "designs": 18,
    "null_designs": 18,
    "coefficients": 12,
    "poor": 10,
    "steady": len(PLANS["steady"].choices),
}
"""Cases of each tier in a full suite: every effect at both sizes, and more than 30 without any."""


@dataclass(frozen=True)
class Job:
    """One case to do: what, where the finished row goes, and with which diagnosis."""

    tier: str
    seed: int
    folder: str
    diagnose: str = PIPELINE
    quick: bool = False

    @property
    def file(self) -> Path:
        return Path(self.folder) / f"{self.tier}-{self.seed:04d}.json"


def seeds(tier: str, count: int, first: int) -> list[int]:
    """Case numbers of a tier; spread over its choices where there are fewer cases than those."""
    choices = len(PLANS[tier].choices)
    if not choices or count >= choices:
        return [first + i for i in range(count)]
    return [first + round(i * choices / count) for i in range(count)]


def jobs(
    folder: Path,
    tiers: Sequence[str] = (),
    limit: int | None = None,
    first: int = 0,
    diagnose: str = PIPELINE,
    quick: bool = False,
) -> list[Job]:
    """The jobs of a suite, tiers taking turns so that an early stop has seen all of them."""
    chosen = {tier: FULL[tier] for tier in (tiers or FULL)}
    turns = [
        (number / count, Job(tier, seed, str(folder), diagnose, quick))
        for tier, count in chosen.items()
        for number, seed in enumerate(seeds(tier, count, first))
    ]
    turns.sort(key=lambda turn: turn[0])
    return [job for _, job in turns][:limit]


def find(name: str) -> Diagnose:
    """The function that "module:function" names."""
    module, function = name.split(":")
    found: Diagnose = getattr(importlib.import_module(module), function)
    return found


def do(job: Job) -> Row:
    """Makes, diagnoses and scores one case; a finished one is read back."""
    return row_of(kept(job.file, partial(_done, job)))


def _done(job: Job) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "data"
        truth = make_case(job.tier, job.seed, folder)
        try:
            answer = find(job.diagnose)(folder, seed=job.seed, quick=job.quick)
            row = score(truth, answer)
        except Exception:
            answer, row = {}, failed(truth, traceback.format_exc())
    return {"row": asdict(row), "effects": {**truth.effects, **truth.foreign}, "answer": answer}


def row_of(finished: Mapping[str, Any]) -> Row:
    """The row of a finished case."""
    content = dict(finished["row"])
    content["named"] = tuple(content["named"])
    content["alternatives"] = tuple(map(tuple, content["alternatives"]))
    return Row(**content)
