"""Numbered realistic cases.

`make_case(tier, seed, folder)` writes a dataset that names the nominal fish only, and returns the
truth, which is also saved beside the folder as `<folder>.truth.json`.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.data import CommandSteps, Dataset, Run, write_dataset
from fish_env.params import load_fish
from tests.hidden.cases import NOMINAL
from tests.hidden.excitation import exciting, merged
from tests.hidden.fishes import draw_fish
from tests.hidden.realistic.budget import budget
from tests.hidden.realistic.catalogue import ALONE, PLANT_SIZES
from tests.hidden.realistic.faults import CLOCKS, FAULTS, TELLS, far_factor
from tests.hidden.realistic.hidden import (
    Piece,
    dirt_pieces,
    draw,
    main_piece,
    piece,
    small_pieces,
    variation_piece,
)
from tests.hidden.realistic.plans import (
    DURATION,
    FORCE,
    MEMORY,
    NOISE,
    PURE_NOISE,
    RATES,
    RUNS,
    TIERS,
)
from tests.hidden.realistic.swimming import Case, draw_run, measured_run
from tests.hidden.realistic.truth import RealTruth, Values

FEWEST_OFF, MOST_OFF = 1, 3
"""How many runs have a beat that is off, where not all have."""


def make_case(tier: str, seed: int, folder: str | Path) -> RealTruth:
    """Writes the dataset of a case and returns what is hidden in it.

    Args:
        tier: one of `plans.TIERS`.
        seed: number of the case; consecutive numbers go through the tier's choices in order.
        folder: new folder for the dataset.
    """
    target = Path(folder)
    streams = np.random.default_rng([zlib.crc32(tier.encode()), seed]).spawn(5)
    make = pure_noise if tier == "noise_only" else swum
    truth = make(tier, seed, target, streams)
    truth.save(target.parent / f"{target.name}.truth.json")
    return truth


def chosen(tier: str, seed: int) -> str:
    """What acts most or alone; empty where nothing does."""
    choices = TIERS[tier].choices
    return choices[seed % len(choices)] if choices else ""


def draw_pieces(tier: str, seed: int, rng: np.random.Generator) -> list[Piece]:
    """Everything hidden in effects and sensors."""
    plan, name = TIERS[tier], chosen(tier, seed)
    if name in PLANT_SIZES:
        return [piece(name, "foreign", draw(name, PLANT_SIZES, 1.0, rng), RUNS)]
    if not plan.real:
        return suspect_pieces(name, rng)
    pieces = [main_piece(name, plan.strength, RUNS, rng)] if name else []
    pieces += small_pieces([name], RUNS, rng)
    taken = [one.name for one in pieces]
    return [*pieces, *dirt_pieces(taken, RUNS, rng), variation_piece(RUNS, rng)]


def suspect_pieces(name: str, rng: np.random.Generator) -> list[Piece]:
    """One thing alone; a wrong column is none of the pieces."""
    if name in FAULTS:
        return []
    if name not in CLOCKS:
        values = draw(name, ALONE, 1.0, rng)
        if name == "angle_limit" and rng.random() < 0.5:
            values["lower"] = -np.inf
        return [piece(name, "suspect", values, RUNS)]
    effect, factor = name.partition(":")[0], far_factor(rng)
    if name == effect:
        return [piece(name, "suspect", {"scale": factor}, RUNS)]
    off = rng.choice(RUNS, size=int(rng.integers(FEWEST_OFF, MOST_OFF + 1)), replace=False)
    each: tuple[Values, ...] = tuple(
        {effect: {"scale": factor}} if run in off else {} for run in range(RUNS)
    )
    return [Piece(name, "suspect", each)]


def swum(tier: str, seed: int, folder: Path, streams: list[np.random.Generator]) -> RealTruth:
    """A case in which a fish swims."""
    plan, name, nominal = TIERS[tier], chosen(tier, seed), NOMINAL[seed % 2]
    pieces = draw_pieces(tier, seed, streams[0])
    case = Case(
        load_fish(nominal),
        draw_fish(nominal, streams[1]),
        tuple(pieces),
        name if name in FAULTS else "",
        RATES[seed % len(RATES)],
        draw_disturbance(streams[2]),
        phase_known=not plan.real or bool(streams[2].integers(2)),
    )
    quality = streams[3].uniform(0.75, 1.3)
    noise = {channel: float(sd * quality) for channel, sd in NOISE.items()}
    drawn = [draw_run(case, run, streams[2]) for run in range(RUNS)]
    runs = tuple(measured_run(case, one, i, noise, streams[3]) for i, one in enumerate(drawn))
    declared = bool(streams[4].integers(2))
    known = {channel: noise[channel] for channel in runs[0].channels if channel in noise}
    write_dataset(Dataset(f"trial-{seed:04d}", nominal, runs, known if declared else {}), folder)
    return RealTruth(
        tier,
        seed,
        nominal,
        plan.strength if name else 0.0,
        **parts(pieces),
        **({"suspect": {name: {}}} if name in FAULTS else {}),
        tells=tells(name),
        coefficients=case.fish.values(),
        disturbance=dict(case.disturbance),
        noise=noise,
        budget=budget(case, drawn, noise) if plan.budget else {},
        about={"noise_declared": declared, "rate": case.rate, "phase_known": case.phase_known},
    )


def tells(name: str) -> tuple[str, ...]:
    """Words of which a message about a wrong input has at least one."""
    return FAULTS[name].tells if name in FAULTS else {**CLOCKS, **TELLS}.get(name, ())


def parts(pieces: list[Piece]) -> dict[str, Any]:
    """The pieces as the truth tells them, by role."""
    out: dict[str, Any] = {}
    for one in pieces:
        if one.role == "variation":
            out["variation"] = list(one.runs)
        else:
            # A beat that is off in some runs is told by the first of these.
            values = next(run for run in one.runs if run)
            out.setdefault(one.role, {})[one.name] = next(iter(values.values()))
    return out


def draw_disturbance(rng: np.random.Generator) -> dict[str, Any]:
    """Size and kind of the random push, as in the plain tiers."""
    return {
        "colour": "ou",
        "force": float(rng.uniform(*FORCE)),
        "time_constant": float(np.exp(rng.uniform(*np.log(MEMORY)))),
        "inertial": bool(rng.integers(2)),
    }


def pure_noise(tier: str, seed: int, folder: Path, streams: list[np.random.Generator]) -> RealTruth:
    """Real commands, and channels that hold nothing but white noise."""
    nominal, rate = NOMINAL[seed % 2], RATES[0]
    times = np.round(np.arange(round(DURATION * rate) + 1) / rate, 6)
    runs = []
    for run in range(RUNS):
        rows = merged(exciting(rate, DURATION, ("steps", "waves")[run % 2], streams[0]))
        rows[:, 0] = np.round(rows[:, 0], 6)
        channels = {name: PURE_NOISE * streams[1].standard_normal(len(times)) for name in NOISE}
        steps = CommandSteps(rows[:, 0], rows[:, 1:])
        runs.append(
            Run.from_steps(f"r{run + 1:02d}", times, channels, steps, start="rest", tail_phase=0.0)
        )
    write_dataset(Dataset(f"trial-{seed:04d}", nominal, tuple(runs)), folder)
    return RealTruth(tier, seed, nominal, 0.0, noise=dict.fromkeys(NOISE, PURE_NOISE))
