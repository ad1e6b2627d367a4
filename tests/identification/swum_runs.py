"""Runs under an overhead camera, made up with the simulator, which shares no code with a fit."""

import numpy as np

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.simulator import InitialState, Simulator

FISH = "msu-tail-fish"
PATHS = ("tail.lift.c1", "body.plane_xy.drag.c0")
CONDITIONS = ((0.0, 0.3), (0.35, 0.3), (-0.35, 0.45), (0.2, 0.5))
"""Offset and amplitude of the tail (rad)."""
PACE = 0.97
START = InitialState((0.1, 0.2, 0.0), (0.0, 0.0, 0.3), (0.02, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
NOISE = np.array([5e-4, 5e-4, 5e-3])


def swum(effects=None, conditions=CONDITIONS, seconds=7.0, noise=1.0, seed=0, switch=False):
    """Runs of a fish whose tail beats at PACE times the commanded frequency.

    Args:
        effects: further effects of the fish; or one such choice for each run.
        conditions: offset and amplitude of each run.
        seconds: length of a run.
        noise: size of the camera's noise, in units of NOISE.
        seed: of the noise.
        switch: whether commands change halfway.
    """
    rng, runs = np.random.default_rng(seed), []
    time = np.arange(0.0, seconds, 0.08)
    for i, (offset, amplitude) in enumerate(conditions):
        own = effects[i] if isinstance(effects, list) else effects or {}
        rows = [{"t": 0.0, "tail_offset": offset, "tail_amplitude": amplitude}]
        if switch:
            halfway = float(time[len(time) // 2])
            rows.append({"t": halfway, "tail_offset": -offset, "tail_amplitude": amplitude})
        rows = [{**row, "tail_frequency": 1.0} for row in rows]
        fish = Simulator(FISH, 0.005, {"frequency_scale": {"scale": PACE}, **own})
        swim = fish.run(rows, sample_times_s=time, initial=START)
        seen = np.column_stack([swim[name] for name in ("x", "y", "yaw")])
        seen += noise * NOISE * rng.standard_normal(seen.shape)
        commands = CommandSteps(
            [row["t"] for row in rows],
            [[row["tail_offset"], row["tail_amplitude"], 1.0, 0.0, 0.0] for row in rows],
        )
        channels = dict(zip(("x", "y", "yaw"), seen.T, strict=True))
        runs.append(Run(f"r{i}", time, channels, commands, "unknown", None, f"c{i // 2}"))
    return Dataset("swum", FISH, tuple(runs))
