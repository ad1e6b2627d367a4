"""Measured runs made up with the filter's own assumptions: white sensors and a random wrench."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt

from fish_env.data import CommandSteps, Dataset, Run
from fish_env.effects.extended import ExtendedModel
from fish_env.identification.applied_wrench import EFFECT as APPLIED_WRENCH
from fish_env.identification.filter_kernels import filter_kernels
from fish_env.identification.noise_model import NoiseModel
from fish_env.model.grid import Grid
from fish_env.params import load_fish
from fish_env.sensing.channels import channels_from_states

FISH = "zheng-2021-a"
ALL = ("x", "y", "z", "roll", "pitch", "yaw", "p", "q", "r")
SENSOR_SD = dict.fromkeys("xyz", 0.0015) | dict.fromkeys(("roll", "pitch", "yaw"), 0.004)
SENSOR_SD |= dict.fromkeys("pqr", 0.008)
PATHS = (
    "tail.drag.c2",
    "tail.lift.c1",
    "body.plane_xy.drag.c0",
    "body.rotational_damping[2]",
    "inertia.rest[2]",
)


def model():
    """The nominal fish behind the lean kernel."""
    return ExtendedModel(load_fish(FISH), {}, (APPLIED_WRENCH,), ())


@dataclass
class Setup:
    """What is simulated."""

    seed: int = 0
    runs: int = 2
    duration: float = 8.0
    rate: float = 25.0
    channels: tuple[str, ...] = ALL
    force_sd: float = 0.003
    moment_sd: float = 1e-4
    correlation_s: float = 1.0
    changes: dict[str, float] = field(default_factory=dict)
    phase: float = 0.0
    phase_known: bool = True
    rest_s: float = 0.0
    missing: float = 0.0
    uneven: bool = False
    jitter_sd: float = 0.0

    @property
    def noise(self) -> NoiseModel:
        sensor = np.array([SENSOR_SD[name] for name in self.channels])
        known = self.force_sd, self.moment_sd, self.correlation_s
        return NoiseModel(sensor, *known, jitter_sd=self.jitter_sd)


def simulate(setup: Setup, commands: np.ndarray | None = None) -> Dataset:
    """Runs with commands that step every second, or with the same (n, 5) each second of all."""
    rng = np.random.default_rng(setup.seed)
    times = np.arange(round(setup.duration * setup.rate) + 1) / setup.rate
    if setup.uneven:
        times[1:-1] += rng.uniform(-0.3, 0.3, len(times) - 2) / setup.rate
    switch = np.arange(0.0, setup.duration, 1.0)
    low, high = [-0.4, 0.2, 1.0, 0.0, 0.0], [0.4, 0.5, 2.2, 0.0, 0.0]
    values = rng.uniform(low, high, (setup.runs, len(switch), 5))
    steps = [CommandSteps(times[np.searchsorted(times, switch)], v) for v in values]
    if commands is not None:
        values = np.broadcast_to(commands, (setup.runs, len(switch), 5))
        steps = [CommandSteps(times[np.searchsorted(times, switch)], v) for v in values]
    states = motion(setup, times, steps, rng)
    runs = []
    for i in range(setup.runs):
        true = channels_from_states(states[:, :, i].T)
        if setup.jitter_sd:
            late = times + setup.jitter_sd * rng.standard_normal(len(times))
            true = {n: CubicSpline(times, np.unwrap(v))(late) for n, v in true.items()}
        shown = {
            n: true[n] + SENSOR_SD[n] * rng.standard_normal(len(times)) for n in setup.channels
        }
        for channel in shown.values():
            channel[rng.random(len(times)) < setup.missing] = np.nan
        start = "rest" if setup.phase_known else "unknown"
        phase = setup.phase if setup.phase_known else None
        runs.append(Run(f"r{i}", times, shown, steps[i], start, phase))
    return Dataset("synthetic", FISH, tuple(runs), {n: SENSOR_SD[n] for n in setup.channels})


def motion(setup, times, steps, rng):
    """States (T, states, runs)."""
    fish = model()
    kernels, count = filter_kernels(fish), setup.runs
    par = np.repeat(fish.records(setup.changes), count, axis=1)
    state = np.zeros((len(kernels.state_names), count))
    state[2], state[3], state[13] = 1.0, 1.0, setup.phase
    spread = np.repeat([setup.force_sd, setup.moment_sd], 3)[:, None]
    wrench = spread * rng.standard_normal((6, count))
    out = [state.copy()]
    for k, span in enumerate(np.diff(times)):
        commands = np.stack([s.at([times[k]])[0] for s in steps], axis=1)
        par[-6:] = wrench
        sub = max(1, int(np.ceil(span / 0.01 - 1e-9)))
        grid = Grid(*(np.array([v]) for v in (0, 0.0, sub, span / sub, 1)))
        kernels.advance(
            state, commands.copy(), par, np.full((5, count), np.inf), np.full(count, times[k]),
            commands[None], grid, tables=fish.tables, failed_at=np.full(count, np.inf),
        )  # fmt: skip
        keep = np.exp(-span / setup.correlation_s)
        fresh = spread * rng.standard_normal((6, count))
        wrench = keep * wrench + np.sqrt(1.0 - keep**2) * fresh
        out.append(state.copy())
    return np.array(out)


def through_low_pass(dataset, cutoff_hz):
    """The data as an inertial unit with scipy's Butterworth filter of second order shows them."""
    sections = butter(2, cutoff_hz, fs=1000.0, output="sos")
    runs = []
    for run in dataset.runs:
        even = np.arange(0.0, run.time_s[-1] + 0.001, 0.001)
        seen = dict(run.channels)
        for name in ("roll", "pitch", "yaw", "p", "q", "r"):
            values = CubicSpline(run.time_s, seen[name])(even)
            smooth = sosfilt(sections, values - values[0]) + values[0]
            seen[name] = CubicSpline(even, smooth)(run.time_s)
        runs.append(replace(run, channels=seen))
    return replace(dataset, runs=tuple(runs))


def with_calm_gyros(problem):
    """The problem as where runs differ: gyros judge nothing just after a jump."""
    return problem.with_runs([run.without_smeared_gyros(problem.channels) for run in problem.runs])
