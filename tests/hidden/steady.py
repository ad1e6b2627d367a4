"""Tables of steady motion of the hidden fish: means over whole tail beats after the transient."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fish_env.data import SteadyDataset, write_dataset
from fish_env.params import FishParams
from tests.hidden.disturbances import draw_push
from tests.hidden.measurement import channels_of, distorted
from tests.hidden.plans import Plan
from tests.hidden.simulate import Start, Swim
from tests.hidden.truth import Truth

SETTLE, WINDOW = 90.0, 10.0
"""s. Time to forget the start, and longest time to average over."""
STEP = 0.005
SAMPLES_PER_BEAT = 40


def commands(rng: np.random.Generator) -> np.ndarray:
    """A grid of amplitudes, frequencies and offsets, some with the block moved, (n, 5)."""
    rows = [
        (offset, amplitude, frequency, 0.0, 0.0)
        for amplitude in np.radians((10.0, 18.0, 26.0))
        for frequency in (1.0, 1.5, 2.2)
        for offset in np.radians((-25.0, 0.0, 12.0))
    ]
    rows += [(0.0, np.radians(20.0), 1.8, shift, 0.0) for shift in (-0.006, -0.003, 0.003, 0.006)]
    repeats = rng.choice(len(rows), 6, replace=False)
    return np.round(np.array(rows + [rows[i] for i in repeats]), 4)


def write_steady(
    truth: Truth, fish: FishParams, plan: Plan, folder: Path, streams: list[np.random.Generator]
) -> Truth:
    """Swims every row of the table and writes the means."""
    table = commands(streams[0])
    disturbance = {
        "colour": "ou",
        "force": float(streams[1].uniform(*plan.force)),
        "time_constant": float(np.exp(streams[1].uniform(*np.log(plan.memory)))),
        "inertial": bool(streams[1].integers(2)),
    }
    truth = replace(truth, disturbance=disturbance, noise=dict(plan.noise))
    means = [steady_row(truth, fish, row, streams[1]) for row in table]
    observations = {
        name: np.array([mean[name] for mean in means]) + sd * streams[2].standard_normal(len(table))
        for name, sd in plan.noise.items()
    }
    names = [",".join(f"{value:g}" for value in row) for row in table]
    conditions = tuple(f"c{sorted(set(names)).index(name):02d}" for name in names)
    ids = tuple(f"s{i + 1:02d}" for i in range(len(table)))
    dataset = SteadyDataset(
        f"table-{truth.seed:04d}", truth.fish, ids, conditions, table, observations, truth.noise
    )
    write_dataset(dataset, folder)
    return truth


def steady_row(
    truth: Truth, fish: FishParams, row: np.ndarray, rng: np.random.Generator
) -> dict[str, float]:
    """Means of one row over whole beats: velocity along the body's axes, yaw rate, pitch."""
    beat = 1.0 / row[2]
    beats = int(WINDOW / beat)
    times = SETTLE + np.arange(beats * SAMPLES_PER_BEAT + 1) * beat / SAMPLES_PER_BEAT
    about = truth.disturbance
    push = draw_push(
        about["colour"],
        about["force"],
        about["time_constant"],
        about["inertial"],
        (0.0, times[-1] + 1.0),
        rng,
    )
    swimmer = Swim(
        fish.values(),
        {**truth.effects, **truth.foreign},
        Start(position=(0.0, 0.0, 1.0)),
        push,
        STEP,
    )
    swimmer.command(np.concatenate([[0.0], row])[None])
    states = swimmer.run(float(times[-1]), times)
    seen = distorted(channels_of(states), truth.effects)
    return {
        "surge_speed": float(seen["u"][:-1].mean()),
        "sway_speed": float(seen["v"][:-1].mean()),
        "heave_speed": float(seen["w"][:-1].mean()),
        "yaw_rate": float((seen["yaw"][-1] - seen["yaw"][0]) / (times[-1] - times[0])),
        "pitch": float(seen["pitch"][:-1].mean()),
    }
