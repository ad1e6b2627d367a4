"""Numbered cases: a fish, its runs, and something hidden in them.

`make_case(tier, seed, folder)` writes a dataset that names the nominal fish only, and returns the
truth, which is also saved beside the folder as `<folder>.truth.json`.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from fish_env.params import FishParams
from tests.hidden.fishes import draw_fish, move_coefficients
from tests.hidden.plans import Plan, plan_of
from tests.hidden.recording import Experiment, record, write
from tests.hidden.sizes import FOREIGN_SIZES, SIZES, draw_effect
from tests.hidden.steady import write_steady
from tests.hidden.truth import Truth, hidden_from_all

NOMINAL = ("zheng-2021-a", "zheng-2021-b")


def make_case(
    tier: str,
    seed: int,
    folder: str | Path,
    effects: Mapping[str, float] | None = None,
) -> Truth:
    """Writes the dataset of a case and returns what is hidden in it.

    Args:
        tier: one of `plans.PLANS`.
        seed: number of the case; in tiers with one effect, consecutive numbers go through the
            catalogue in order.
        folder: new folder for the dataset.
        effects: strength by effect, to choose other effects than the seed does.
    """
    target, plan = Path(folder), plan_of(tier, seed)
    streams = np.random.default_rng([zlib.crc32(tier.encode()), seed]).spawn(5)
    truth = draw_truth(tier, seed, plan, effects, streams[0])
    fish, truth = hidden_fish(truth, plan, streams[1])
    truth = write_case(truth, fish, plan, target, streams[2:])
    truth.save(target.parent / f"{target.name}.truth.json")
    return truth


def draw_truth(
    tier: str,
    seed: int,
    plan: Plan,
    chosen: Mapping[str, float] | None,
    rng: np.random.Generator,
) -> Truth:
    """Which effects act, and how much."""
    strengths = dict(chosen) if chosen is not None else choose(plan, seed, rng)
    drawn = {name: draw_effect(name, strength, rng) for name, strength in strengths.items()}
    if "pitch" not in plan.noise and "attitude_misalignment" in drawn:
        drawn["attitude_misalignment"] |= {"roll": 0.0, "pitch": 0.0}
    effects = {name: values for name, values in drawn.items() if name in SIZES}
    return Truth(
        tier=tier,
        seed=seed,
        fish=NOMINAL[seed % 2],
        effects=effects,
        foreign={name: values for name, values in drawn.items() if name in FOREIGN_SIZES},
        strength=max(strengths.values(), default=0.0),
        visible=plan.visible and not hidden_from_all(tuple(effects)),
    )


def choose(plan: Plan, seed: int, rng: np.random.Generator) -> dict[str, float]:
    """Names and strengths that a seed stands for."""
    if not plan.choices:
        return {}
    choice = plan.choices[seed % len(plan.choices)]
    return dict.fromkeys(choice, plan.strength)


def hidden_fish(truth: Truth, plan: Plan, rng: np.random.Generator) -> tuple[FishParams, Truth]:
    """The true fish; in the tier of coefficients some are far off."""
    fish = draw_fish(truth.fish, rng)
    moved: dict[str, float] = {}
    if plan.moved:
        fish, moved = move_coefficients(fish, truth.fish, int(rng.integers(*plan.moved)), rng)
    return fish, replace(truth, moved=moved, coefficients=fish.values())


def write_case(
    truth: Truth,
    fish: FishParams,
    plan: Plan,
    folder: Path,
    streams: list[np.random.Generator],
) -> Truth:
    """Swims the runs and writes them."""
    if plan.steady:
        return write_steady(truth, fish, plan, folder, streams)
    experiment = Experiment(truth, fish, plan, streams)
    return write(experiment, record(experiment), folder)
