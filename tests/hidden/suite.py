"""Which cases the suites hold, and how one of them is made, diagnosed and scored."""

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
from tests.hidden import cases, scoring, summary
from tests.hidden.plans import PLANS
from tests.hidden.realistic import cases as realistic_cases
from tests.hidden.realistic import scoring as realistic_scoring
from tests.hidden.realistic import summary as realistic_summary
from tests.hidden.realistic.plans import TIERS
from tests.hidden.realistic.truth import RealTruth
from tests.hidden.truth import Truth

Diagnose = Callable[..., Mapping[str, Any]]
PIPELINE = "fish_env.diagnosis.pipeline:diagnose"
CATALOGUE = "fish_env.effects:catalogue"
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
REALISTIC = {name: tier.cases for name, tier in TIERS.items()}
"""Cases of each tier of the realistic suite."""


@dataclass(frozen=True)
class Suite:
    """One suite.

    Attributes:
        title: heading of its page.
        result: first part of the name of its result.
        counts: cases of each tier.
        choices: how many kinds of cases a tier has, which consecutive numbers go through.
        finish: makes a case in a folder, and diagnoses and scores it: the folder, the job.
        row_of: the row of a finished case.
        summarise: rates of the rows.
        markdown: the rates as a page.
    """

    title: str
    result: str
    counts: Mapping[str, int]
    choices: Callable[[str], int]
    finish: Callable[[Path, Job], dict[str, Any]]
    row_of: Callable[[Mapping[str, Any]], Any]
    summarise: Callable[[Sequence[Any]], dict[str, Any]]
    markdown: Callable[[dict[str, Any]], str]

    def page(self, date: str, said: str, summary: dict[str, Any]) -> str:
        """The summary as the page of a day, under a sentence on where it comes from."""
        return f"# {self.title}, {date}\n\n{said}\n\n{self.markdown(summary)}"


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
    choices = suite_of(tier).choices(tier)
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
    """The jobs of some tiers, which take turns so that an early stop has seen all of them."""
    chosen = {tier: suite_of(tier).counts[tier] for tier in (tiers or FULL)}
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


def do(job: Job) -> Any:
    """Makes, diagnoses and scores one case; a finished one is read back."""
    return keep(job, partial(make, job))


def make(job: Job) -> dict[str, Any]:
    """Makes, diagnoses and scores one case, and writes nothing that stays."""
    with tempfile.TemporaryDirectory() as place:
        return suite_of(job.tier).finish(Path(place) / "data", job)


def keep(job: Job, content: Callable[[], Mapping[str, Any]]) -> Any:
    """The row of a case; what is not finished is written, whole."""
    return suite_of(job.tier).row_of(kept(job.file, content))


def _answer(folder: Path, job: Job) -> Mapping[str, Any]:
    return find(job.diagnose)(folder, seed=job.seed, quick=job.quick)


def _finish_plain(folder: Path, job: Job) -> dict[str, Any]:
    truth: Truth = cases.make_case(job.tier, job.seed, folder)
    answer: Mapping[str, Any] = {}
    try:
        answer = _answer(folder, job)
        row = scoring.score(truth, answer)
    except Exception:
        answer, row = {}, scoring.failed(truth, traceback.format_exc())
    return {"row": asdict(row), "effects": {**truth.effects, **truth.foreign}, "answer": answer}


def _finish_realistic(folder: Path, job: Job) -> dict[str, Any]:
    truth: RealTruth = realistic_cases.make_case(job.tier, job.seed, folder)
    answer: Mapping[str, Any] = {}
    try:
        answer = _answer(folder, job)
        row = realistic_scoring.score(truth, answer, set(find(CATALOGUE)()))
    except Exception as error:
        row = realistic_scoring.failed(truth, error, traceback.format_exc())
    return {"row": asdict(row), "truth": asdict(truth), "answer": answer}


def row_of(finished: Mapping[str, Any], kind: type[Any] = scoring.Row) -> Any:
    """The row of a finished case."""
    content = dict(finished["row"])
    for name in ("named", "claimed", "false_names"):
        if name in content:
            content[name] = tuple(content[name])
    content["alternatives"] = tuple(map(tuple, content["alternatives"]))
    return kind(**content)


SUITES = {
    "catalogue": Suite(
        "Hidden-effect suite",
        "diagnosis",
        FULL,
        lambda tier: len(PLANS[tier].choices),
        _finish_plain,
        row_of,
        summary.summarise,
        summary.markdown,
    ),
    "realistic": Suite(
        "Realistic suite",
        "realistic",
        REALISTIC,
        lambda tier: len(TIERS[tier].choices),
        _finish_realistic,
        partial(row_of, kind=realistic_scoring.RealRow),
        realistic_summary.summarise,
        realistic_summary.markdown,
    ),
}
"""The suites by name; no two have a tier of the same name."""


def suite_of(tier: str) -> Suite:
    """The suite that has a tier.

    Raises:
        KeyError: No such tier.
    """
    for suite in SUITES.values():
        if tier in suite.counts:
            return suite
    raise KeyError(tier)
