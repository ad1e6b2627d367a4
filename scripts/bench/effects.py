"""What effects cost, and what is wrong at 100 Hz after a minute of jumps.

    python -m scripts.bench.effects errors    # after compiling, about a minute
    python -m scripts.bench.effects costs     # some minutes, most of them compiling
    python -m scripts.bench.effects costs --only servo_lag,current --fish 1

Costs are processor times of the rollout, taken in turn with those of a fish without effects; each
is the median of the ratios of all rounds. ``whole`` is the kernel with the whole catalogue.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import numpy as np

from fish_env import Simulator, load_fish
from fish_env.arrays import FloatArray
from fish_env.data.schema import CommandSteps
from fish_env.effects import catalogue
from fish_env.effects.extended import EffectValues, ExtendedModel, build_model
from fish_env.model.grid import Grid

FISH = "zheng-2021-a"
DT, FINE, SECONDS = 0.01, 1.0 / 3200.0, 60.0
LOW, HIGH = (-0.5, 0.0, 0.5, -0.01, -0.2), (0.5, 0.6, 3.0, 0.01, 0.2)
LIMIT: EffectValues = {"servo_rate_limit": {"rate": 5.0}}
PLAY: EffectValues = {"servo_backlash": {"gap": 0.08}}
LATE: EffectValues = {"servo_delay": {"delay": 0.043}}
CASES: dict[str, EffectValues] = {
    "none": {},
    "rate limit": LIMIT,
    "play": PLAY,
    "delay": LATE,
    "rate limit, play, delay": {**LIMIT, **PLAY, **LATE},
    "lag of 30 ms": {"servo_lag": {"time_constant": 0.03}},
    "lag of 8 ms": {"servo_lag": {"time_constant": 0.008}},
    "lag of 2 ms": {"servo_lag": {"time_constant": 0.002}},
    "flexible, 5 Hz": {"tail_flexibility": {"natural_frequency": 5.0, "damping_ratio": 0.3}},
    "flexible, 30 Hz": {"tail_flexibility": {"natural_frequency": 30.0, "damping_ratio": 0.3}},
}
STEPS = 100


def jumps(seed: int, every: float) -> CommandSteps:
    """Commands of a minute that all jump at random times, on average ``every`` so often (s)."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5 * every, 1.5 * every, int(2 * SECONDS / every)))
    times = np.append(0.0, times[times < SECONDS])
    return CommandSteps(times, rng.uniform(LOW, HIGH, (len(times), 5)))


def error(effects: EffectValues, seed: int, every: float) -> tuple[float, float]:
    """Largest distance (mm) and angle (deg) between a run at 100 Hz and one at 3200 Hz."""
    runs = [
        Simulator(FISH, dt, effects).run(jumps(seed, every), SECONDS).states for dt in (DT, FINE)
    ]
    distance = np.linalg.norm(runs[0][:, :3] - runs[1][:, :3], axis=1).max()
    cosine = np.abs(np.sum(runs[0][:, 3:7] * runs[1][:, 3:7], axis=1)).min()
    return 1e3 * distance, np.degrees(2.0 * np.arccos(min(cosine, 1.0)))


def errors(seeds: int) -> None:
    """Print the errors of every case."""
    for name, effects in CASES.items():
        for every in (0.1, 1.0):
            found = np.array([error(effects, seed, every) for seed in range(seeds)])
            print(
                f"{name:24} jumps every {every:3g} s: median {np.median(found[:, 0]):8.3f} mm, "
                f"largest {found[:, 0].max():8.3f} mm and {found[:, 1].max():7.4f} deg",
                flush=True,
            )


def rollout(model: ExtendedModel, count: int) -> Callable[[], float]:
    """A function that swims a second and returns its processor time for a step of a fish (ns)."""
    kernels = model.kernels
    begin = np.zeros((len(kernels.state_names), count))
    begin[3], begin[7] = 1.0, 0.2
    record = np.ascontiguousarray(np.repeat(model.record, count, axis=1))
    inputs = np.repeat(np.array([0.1, 0.4, 2.0, 0.0, 0.0])[:, None], count, axis=1)
    kernels.initialise(begin, inputs, record, np.zeros(count))
    numbers = np.zeros(1, np.int64), np.zeros(1), np.array([STEPS]), np.array([DT])
    grid = Grid(*numbers, np.array([STEPS]))

    def swim() -> float:
        state, failed = begin.copy(), np.full(count, np.inf)
        started = time.process_time()
        kernels.advance(
            state, inputs.copy(), record, np.full((5, count), np.inf), np.zeros(count),
            inputs[None].copy(), grid, tables=model.tables, failed_at=failed, threads=1,
        )  # fmt: skip
        return 1e9 * (time.process_time() - started) / (STEPS * count)

    return swim


def alone(name: str) -> EffectValues:
    """An effect at the upper end of its plausible sizes."""
    parameters = catalogue()[name].parameters
    return {name: {p.name: p.plausible[1] for p in parameters if p.plausible}}


def costs(names: list[str], count: int, rounds: int) -> None:
    """Print how long a step takes with one effect on, against one without effects."""
    fish = load_fish(FISH)
    models = {"lean": build_model(fish)}
    models |= {name: build_model(fish, alone(name)) for name in names}
    models["rate limit, play, delay"] = build_model(fish, {**LIMIT, **PLAY, **LATE})
    models["whole"] = build_model(fish, whole_catalogue=True)
    swims = {name: rollout(model, count) for name, model in models.items()}
    for swim in swims.values():
        swim()
    taken: dict[str, FloatArray] = {name: np.zeros(rounds) for name in swims}
    for turn in range(rounds):
        for name, swim in swims.items():
            taken[name][turn] = swim()
    ratios = {name: float(np.median(times / taken["lean"])) for name, times in taken.items()}
    for name in sorted(ratios, key=ratios.__getitem__):
        print(f"{name:24} {np.median(taken[name]):8.1f} ns  {ratios[name]:5.2f}")
    single = [ratios[name] for name in names]
    print(f"{count} fish: median {np.median(single):.2f}, largest {max(single):.2f}")


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("what", choices=("errors", "costs"))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--fish", type=int, default=64, help="in a batch, 1 for the kernel of one")
    parser.add_argument("--rounds", type=int, default=31)
    parser.add_argument("--only", default="", help="effects, with commas between")
    options = parser.parse_args(argv)
    if options.what == "errors":
        errors(options.seeds)
        return
    moving = [name for name, effect in catalogue().items() if effect.acts_on_motion]
    wanted = options.only.split(",") if options.only else moving
    if unknown := set(wanted) - set(moving):
        sys.exit(f"no effects on the motion: {', '.join(sorted(unknown))}")
    costs(wanted, options.fish, options.rounds)


if __name__ == "__main__":
    main()
