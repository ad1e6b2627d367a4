"""The real fish of the measured runs: its coefficients, and how well they predict other conditions.

Every condition (a tail amplitude and offset) is left out in turn, in five groups. A run of a
condition left out is predicted from its first three seconds to its end by coefficients that no
run of the condition has touched.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.effects.extended import PREFIX
from fish_env.params.provenance import Posterior
from fish_env.params.schema import FishParams
from fish_env.studies.rollouts import PACE, WholeRuns
from fish_env.studies.tracks import Track, Weights
from fish_env.studies.whole_runs import RunFit, fit_runs, predict

PATHS = (
    "mass.static_moment_rest[0]",
    "inertia.rest[2]",
    "tail.root[0]",
    "tail.center_of_pressure",
    "tail.area",
    "tail.drag.c0",
    "tail.drag.c2",
    "tail.lift.c1",
    "body.area[0]",
    "body.area[1]",
    "body.plane_xz.drag.c0",
    "body.plane_xy.drag.c0",
    "body.plane_xy.drag.c2",
    "body.plane_xy.lift.c1",
    "body.plane_xy.impact_moment",
    "body.rotational_damping[2]",
)
"""Coefficients that a fish swimming level at the surface shows; the others keep their values. Its
mass is among those: forces over mass is all that a path shows, and a mass that leaves the buoyancy
behind would let the fish sink, unseen by a camera overhead, and so find another drag."""
EFFECTS = (
    "wake_fraction.fraction",
    "tail_gain.gain",
    "linear_drag.sway",
)
"""Effects of the fish that is written. With ``tail_reactive`` beside them the fit has no minimum
near a fish: the objective falls slowly on the way to a tail without lift in nearly still water.
Runs at one frequency do not part the two kinds of thrust."""
WEIGHTS = Weights(
    position_sd=0.01, angle_sd=0.05, speed_sd=1e-4, rate_sd=1e-4, memory_s=3.0, samples=15.0
)
"""Of the errors: what the model misses within and between beats, about a centimetre and 0.05 rad,
with fifteen independent samples a run. They are far above the camera's noise, because the model is
not that good: with the camera's own weights the shape of a beat, which no coefficient gets right,
decides over speed and yaw rate, which a prediction is for."""
FIRST_S = 3.0
GROUPS = 5
STEPS, TOLERANCE = 100, 1e-6
"""Most steps of a fit, and the relative decrease of its objective at which it is at rest. Runs bend
so much with some coefficients that ten thousandths are far from it."""


@dataclass(frozen=True)
class RunError:
    """How a prediction of one run differs from it.

    Attributes:
        run, condition: names.
        surge, sway: error of the mean over the second half, m/s.
        yaw_rate: error of the slope of the yaw over the second half, rad/s.
        path: root mean square distance over the run, m.
        yaw: root mean square error over the run, rad.
        measured_surge, measured_yaw_rate: what was measured, m/s and rad/s.
        measured_radius, predicted_radius: surge over yaw rate, m.
    """

    run: str
    condition: str
    surge: float
    sway: float
    yaw_rate: float
    path: float
    yaw: float
    measured_surge: float
    measured_yaw_rate: float
    measured_radius: float
    predicted_radius: float


def second_half(track: Track, pose: FloatArray) -> FloatArray:
    """Mean surge and sway speed (m/s) and yaw rate (rad/s) over the second half of a run."""
    late = track.time_s >= 0.5 * track.time_s[-1]
    time, (x, y, yaw) = track.time_s[late], pose[late].T
    vx, vy = np.gradient(x, time), np.gradient(y, time)
    surge = np.mean(vx * np.cos(yaw) + vy * np.sin(yaw))
    sway = np.mean(vy * np.cos(yaw) - vx * np.sin(yaw))
    return np.array([surge, sway, np.polyfit(time, yaw, 1)[0]])


def error_of(track: Track, predicted: FloatArray) -> RunError:
    """Compare a prediction (samples, 3) with its run."""
    truth, model = second_half(track, track.measured), second_half(track, predicted)
    away = predicted - track.measured
    return RunError(
        track.id,
        track.condition,
        surge=float(model[0] - truth[0]),
        sway=float(model[1] - truth[1]),
        yaw_rate=float(model[2] - truth[2]),
        path=float(np.sqrt(np.mean(away[:, 0] ** 2 + away[:, 1] ** 2))),
        yaw=float(np.sqrt(np.mean(away[:, 2] ** 2))),
        measured_surge=float(truth[0]),
        measured_yaw_rate=float(truth[2]),
        measured_radius=float(truth[0] / abs(truth[2])),
        predicted_radius=float(model[0] / abs(model[2])),
    )


def errors_of(
    model: WholeRuns, x: FloatArray, tracks: Sequence[Track], pace: float
) -> list[RunError]:
    """Errors of predictions from the first seconds of each run."""
    return [error_of(t, predict(model, x, t, WEIGHTS, pace, FIRST_S)) for t in tracks]


def groups_of(tracks: Sequence[Track], seed: int = 0) -> list[list[str]]:
    """Conditions in groups that are left out together."""
    names = sorted({track.condition for track in tracks})
    order = np.random.default_rng(seed).permutation(len(names))
    return [[names[i] for i in part] for part in np.array_split(order, GROUPS)]


def leave_out(
    model: WholeRuns,
    tracks: Sequence[Track],
    whole: RunFit,
    report: Callable[[str], None] = lambda step: None,
) -> list[RunError]:
    """Errors on conditions that were left out of the fit, of every run."""
    found: list[RunError] = []
    for out in groups_of(tracks):
        report(f"leaving out {', '.join(out)}")
        kept = [i for i, track in enumerate(tracks) if track.condition not in out]
        near = (whole.x, whole.starts[kept])
        part = fit_runs(model, [tracks[i] for i in kept], WEIGHTS, *near, STEPS, TOLERANCE)
        held = [track for track in tracks if track.condition in out]
        found += errors_of(model, part.x, held, pace_of(part))
    order = {track.id: i for i, track in enumerate(tracks)}
    return sorted(found, key=lambda e: order[e.run])


def pace_of(fit: RunFit) -> float:
    """Tail frequency over the commanded one, mean over runs."""
    return float(np.mean(fit.starts[:, PACE]))


def repeat_scatter(tracks: Sequence[Track]) -> FloatArray:
    """Standard deviation between repeats of second-half surge, sway and yaw rate."""
    groups: dict[str, list[FloatArray]] = {}
    for track in tracks:
        groups.setdefault(track.condition, []).append(second_half(track, track.measured))
    squares = [np.sum((np.array(g) - np.mean(g, axis=0)) ** 2, axis=0) for g in groups.values()]
    freedom = sum(len(group) - 1 for group in groups.values())
    return np.asarray(np.sqrt(np.sum(squares, axis=0) / freedom))


def summary(errors: Sequence[RunError]) -> dict[str, float]:
    """Root mean squares over runs, and mean relative errors of surge, yaw rate and radius."""
    table = {key: np.array([asdict(e)[key] for e in errors]) for key in asdict(errors[0])}
    turning = np.abs(table["measured_yaw_rate"]) > 0.03
    rms = {
        key: float(np.sqrt(np.mean(table[key] ** 2)))
        for key in ("surge", "sway", "yaw_rate", "path", "yaw")
    }
    surge = np.abs(table["surge"] / table["measured_surge"])
    rate = np.abs(table["yaw_rate"] / table["measured_yaw_rate"])[turning]
    radius = np.abs(table["predicted_radius"] / table["measured_radius"] - 1.0)[turning]
    return {
        **rms,
        "surge_percent": 100.0 * float(surge.mean()),
        "yaw_rate_percent": 100.0 * float(rate.mean()),
        "radius_percent": 100.0 * float(radius.mean()),
    }


def covariance(fit: RunFit, tracks: Sequence[Track]) -> FloatArray:
    """Of the common numbers in their own units, shape (size, size).

    The weights are no likelihood, so the spread of the conditions' gradients says how sure the
    estimates are (the sandwich of Huber, 1967, with conditions as clusters), and the priors.
    """
    conditions = sorted({track.condition for track in tracks})
    sums = np.array(
        [
            sum(g for g, t in zip(fit.gradients, tracks, strict=True) if t.condition == name)
            for name in conditions
        ]
    )
    count = len(conditions)
    meat = count / (count - 1.0) * sums.T @ sums + np.eye(fit.model.size)
    inverse = np.linalg.inv(fit.information)
    turn = np.eye(fit.model.size)
    size = len(fit.model.baseline)
    turn[:size, :size] = fit.model.baseline.factor
    for i, effect in enumerate(fit.model.effects):
        turn[size + i, size + i] = effect.sd
    return np.asarray(turn @ inverse @ meat @ inverse @ turn.T)


def identified(fit: RunFit, tracks: Sequence[Track], name: str, source: str) -> FishParams:
    """The fish of a fit, with its posterior, range of validity and tail frequency."""
    values = dict(
        zip(fit.model.names, fit.model.values(fit.x[:, None])[:, 0].tolist(), strict=True)
    )
    coefficients = {p: v for p, v in values.items() if not p.startswith(PREFIX)}
    fish = fit.model.fish.replace(coefficients, "identified", source)
    effects: dict[str, dict[str, float]] = {"frequency_scale": {"scale": pace_of(fit)}}
    for path, value in values.items():
        if path.startswith(PREFIX):
            effect, parameter = path.removeprefix(PREFIX).split(".")
            effects.setdefault(effect, {})[parameter] = value
    known = covariance(fit, tracks)
    names = (*fit.model.names, f"{PREFIX}frequency_scale.scale")
    whole = np.zeros((len(names), len(names)))
    whole[:-1, :-1] = 0.5 * (known + known.T)
    whole[-1, -1] = float(np.var(fit.starts[:, PACE], ddof=1))
    posterior = Posterior(
        names,
        (*values.values(), pace_of(fit)),
        tuple(tuple(row) for row in whole.tolist()),
        validity(tracks),
    )
    return replace(fish, name=name, effects=effects, posterior=posterior, source_file=None)


def validity(tracks: Sequence[Track]) -> dict[str, Any]:
    """Ranges of commands and of second-half motion behind the estimates."""
    commands = np.array([track.command for track in tracks])
    motion = np.array([second_half(track, track.measured) for track in tracks])
    rows = {
        "tail_offset": commands[:, 0],
        "tail_amplitude": commands[:, 1],
        "tail_frequency": commands[:, 2],
        "surge": motion[:, 0],
        "sway": motion[:, 1],
        "yaw_rate": motion[:, 2],
    }
    return {
        "runs": [track.id for track in tracks],
        "ranges": {name: [float(v.min()), float(v.max())] for name, v in rows.items()},
    }
