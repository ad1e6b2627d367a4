"""Data sets with an effect of a chosen size, and the cheap part of a diagnosis on each."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fish_env.data import Dataset, load_dataset
from fish_env.diagnosis.pipeline import diagnose_runs, fitted_and_final
from fish_env.identification.series import SeriesProblem
from fish_env.inference.estimate.fit import Fit, fit
from fish_env.inference.hypotheses import name_of
from fish_env.inference.preconditions import preconditions
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import Screen, screen
from scripts.power.limits import limits
from tests.hidden.designs import Noise, swim_design
from tests.hidden.records import LIBRARY
from tests.hidden.truth import Truth

Values = Mapping[str, Mapping[str, float]]
NOISES = {"nominal": Noise(), "double": Noise(sensors=2.0, force=0.006)}
NOTHING = {"nominal": 0, "double": 100}
"""Number of the noise of the data set without an effect; no other has it."""


@dataclass(frozen=True)
class Target:
    """One parameter of one effect, moved in one direction from where the effect is off."""

    effect: str
    parameter: str
    sign: float = 1.0

    @property
    def name(self) -> str:
        """Effect and parameter."""
        return f"{self.effect}.{self.parameter}"

    def values(self, departure: float) -> dict[str, dict[str, float]]:
        """Parameters of the effect when this one departs from neutral by so much."""
        neutral = LIBRARY[self.effect]
        moved = neutral[self.parameter] + self.sign * departure
        return {self.effect: {**neutral, self.parameter: moved}}


def measured(design: int, repeat: int, noise: str, effects: Values) -> tuple[Dataset, Truth]:
    """A data set of a design."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "data"
        truth = swim_design(design, repeat, folder, effects, NOISES[noise])
        dataset = load_dataset(folder)
    assert isinstance(dataset, Dataset)
    return dataset, truth


def screened(dataset: Dataset, seed: int) -> tuple[Fit, Screen]:
    """The refitted baseline and the screen of all causes, on the runs a diagnosis would fit."""
    baseline = fit(SeriesProblem(dataset, None, fitted_and_final(dataset, seed)[0]), rounds=2)
    causes = causes_of(baseline.problem)
    return baseline, screen(baseline, causes, np.random.default_rng(seed), keep_changes=True)


def without_effect(design: int, noise: str) -> dict[str, Any]:
    """What is published of a design."""
    begin = time.process_time()
    with threadpool_limits(1, "blas"):
        dataset, _ = measured(design, NOTHING[noise], noise, {})
        baseline, screens = screened(dataset, design)
        causes = causes_of(baseline.problem)
        published = preconditions(baseline.problem, screens, causes, baseline)
        linear = preconditions(baseline.problem, screens, causes)
    first = screens.best()[0]
    return {
        "design": design,
        "noise": noise,
        "threshold": screens.threshold,
        "alarm": first.log_p < screens.threshold,
        "published": sizes_of(published),
        "in_proportion": sizes_of(linear),
        "cpu_s": time.process_time() - begin,
    }


def allowed(design: int, noise: str, nothing: dict[str, Any]) -> dict[str, dict[str, float]]:
    """What the information in the data of a design would allow."""
    dataset, truth = measured(design, NOTHING[noise], noise, {})
    problem = SeriesProblem(dataset, None, fitted_and_final(dataset, design)[0])
    with threadpool_limits(1, "blas"):
        return limits(problem, truth, nothing["published"], nothing["threshold"])


def sizes_of(published: Any) -> dict[str, float]:
    """effect.parameter -> smallest detectable size."""
    return {
        f"{p.name}.{parameter}": float(size)
        for p in published
        for parameter, size in p.smallest_detectable.items()
    }


def with_effect(
    target: Target, multiple: float, published: float, design: int, repeat: int, noise: str
) -> dict[str, Any]:
    """Whether the screen finds an effect of so many times its published size."""
    begin = time.process_time()
    with threadpool_limits(1, "blas"):
        effects = target.values(multiple * published)
        screens = screened(measured(design, repeat, noise, effects)[0], design)[1]
    best = screens.best()
    own = next(s for s in best if s.cause.id == target.effect)
    return {
        "target": target.name,
        "multiple": multiple,
        "design": design,
        "repeat": repeat,
        "noise": noise,
        "found": bool(own.log_p < screens.threshold),
        "misfit": bool(best[0].log_p < screens.threshold),
        "first": name_of(best[0].cause.id),
        "statistic": own.statistic,
        "freedom": own.freedom,
        "bound": float(chi2.isf(np.exp(screens.threshold), own.freedom)),
        "cpu_s": time.process_time() - begin,
    }


def diagnosed(
    target: Target, multiple: float, published: float, design: int, repeat: int, noise: str
) -> dict[str, Any]:
    """What a whole diagnosis makes of the same data."""
    begin = time.process_time()
    dataset, _ = measured(design, repeat, noise, target.values(multiple * published))
    verdict = diagnose_runs(dataset, seed=design).verdict
    return {
        "target": target.name,
        "multiple": multiple,
        "design": design,
        "repeat": repeat,
        "noise": noise,
        "verdict": verdict.name,
        "named": [name_of(cause) for cause in verdict.causes],
        "cpu_s": time.process_time() - begin,
    }
