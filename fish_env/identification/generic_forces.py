"""Forces of no particular origin: simple functions of what the fish does, in six directions.

They ask whether anything is left (:mod:`~fish_env.inference.adequacy`), and what is left is
described by them (:mod:`~fish_env.diagnosis.residual_model`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from fish_env.arrays import FloatArray, IntArray
from fish_env.identification.channels import from_above
from fish_env.identification.filtering import Filtered, Pushes
from fish_env.identification.noise_model import NoiseModel
from fish_env.identification.runs import RunData
from fish_env.inference.estimate.fit import Fit
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.sensing.channels import channels_from_states

DIRECTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
WORD = re.compile("[a-z]+")
PHASE = "phase"
"""Last word of the name of a function that goes with the tail's phase."""
LEVEL = ("surge", "sway", "yaw")
"""Directions that channels show which see the fish from above."""
UPRIGHT = frozenset({"w", "p", "q", "roll", "pitch", "depth"})
"""What such channels do not show, as functions of it are named."""


def wrench_unit(direction: str) -> str:
    """Unit of the force or moment in a direction."""
    return "N" if DIRECTIONS.index(direction) < 3 else "N m"


@dataclass(frozen=True, eq=False)
class GenericForces:
    """Functions along some runs, each a force or moment in one of six directions.

    Column 6 * function + direction is one such wrench.

    Attributes:
        names: of the functions (J).
        scale: (J,) root mean square of each over the runs that define them, in SI units.
        bases: per run (T, J), divided by the scale.
        directions: those that the channels show.
    """

    names: tuple[str, ...]
    scale: FloatArray
    bases: list[FloatArray]
    directions: tuple[str, ...] = DIRECTIONS

    @property
    def columns(self) -> IntArray:
        """Every wrench that the channels show, increasing."""
        shown = [DIRECTIONS.index(direction) for direction in self.directions]
        return np.add.outer(6 * np.arange(len(self.names)), shown).ravel()

    def words(self, column: int) -> tuple[str, str]:
        """Function and direction of a wrench."""
        return self.names[column // 6], DIRECTIONS[column % 6]

    def swings(self, column: int) -> bool:
        """Whether a wrench goes with the tail's phase."""
        return self.names[column // 6].endswith(PHASE)

    def along(self, runs: Sequence[RunData], filtered: Sequence[Filtered]) -> GenericForces:
        """The same functions, of the same scales, along other runs or another motion of them."""
        tables = [regressors(run, result) for run, result in zip(runs, filtered, strict=True)]
        bases = [np.column_stack([table[name] for name in self.names]) for table in tables]
        return replace(self, bases=[basis / self.scale for basis in bases])


def generic_forces(
    runs: Sequence[RunData],
    filtered: Sequence[Filtered],
    channels: Collection[str],
) -> GenericForces:
    """The functions along runs, every one that is not zero throughout.

    Args:
        runs: the runs.
        filtered: their motion.
        channels: names of what was measured. Where none of them shows depth or inclination, neither
            acts: of those the filter only guesses.
    """
    level = from_above(channels)
    tables = [regressors(run, result) for run, result in zip(runs, filtered, strict=True)]
    names = list(tables[0])
    bases = [np.column_stack([table[name] for name in names]) for table in tables]
    scale = np.sqrt(np.mean(np.concatenate(bases) ** 2, axis=0))
    hidden = np.array([level and bool(UPRIGHT & {*WORD.findall(name)}) for name in names])
    kept = np.flatnonzero((scale > 1e-9) & ~hidden)
    scaled = [np.ascontiguousarray(basis[:, kept] / scale[kept]) for basis in bases]
    shown = LEVEL if level else DIRECTIONS
    return GenericForces(tuple(names[i] for i in kept), scale[kept], scaled, shown)


def probes(columns: IntArray) -> FloatArray:
    """Sizes small enough for a slope: a millinewton, a hundredth of a millinewton metre."""
    return np.where(columns % 6 < 3, 1e-3, 1e-5)


class Prodded(Protocol):
    """A problem that can add a prescribed wrench to each point."""

    def changes(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: NoiseModel,
        filtered: Sequence[Filtered],
        pushes: Pushes | None = None,
    ) -> FloatArray:
        """What innovations change from the first point to each other (N - 1, D)."""
        ...


@dataclass(frozen=True, eq=False)
class BoundForces:
    """Generic forces on the runs of a fit, as the adequacy test asks for them.

    Attributes:
        fit: the fit they are added to.
        forces: the forces.
    """

    fit: Fit
    forces: GenericForces

    @property
    def columns(self) -> IntArray:
        """Every wrench that the channels show, increasing."""
        return self.forces.columns

    def words(self, column: int) -> tuple[str, str]:
        """Function and direction of a wrench."""
        return self.forces.words(column)

    def swings(self, column: int) -> bool:
        """Whether a wrench goes with the tail's phase."""
        return self.forces.swings(column)

    def unit(self, column: int) -> float:
        """Size (N or N m) of the wrench behind one unit of :meth:`changes`."""
        return float(probes(np.array([column]))[0])

    def changes(self, columns: IntArray) -> FloatArray:
        """How :func:`probes` of some wrenches change the residuals of the fit (D, N)."""
        fit, count = self.fit, 1 + len(columns)  # the first gets none
        z = np.repeat(fit.point.z[:, None], count, axis=1)
        effects = {id: np.full(count, value) for id, value in fit.point.effects.items()}
        pushes = Pushes(self.forces.bases, np.r_[0, columns], np.r_[0.0, probes(columns)])

        def pushed(problem: Any) -> FloatArray:
            chosen: Prodded = problem
            return chosen.changes(z, effects, fit.noise, fit.filtered, pushes)

        out = pushed(fit.comparing)
        if fit.comparing is not fit.problem and not np.isfinite(out).all():
            out = pushed(fit.problem)
        return out.T


def regressors(run: RunData, filtered: Filtered) -> dict[str, FloatArray]:
    """Functions of the filtered motion that a missing force may depend on, each (T,).

    In SI units, but time in units of 30 s; angles in rad, frequencies in Hz. ``beat`` is amplitude
    times frequency as commanded; north, east, frequency and amplitude count from their mean over
    the run. Depth counts from the surface, as what depends on it is the same at one depth in all
    runs. What goes with the tail's phase is multiplied by the square of the beat.
    """
    c = channels_from_states(filtered.states.T[:18])
    row = np.searchsorted(run.command_times, run.clock, side="right") - 1
    command = run.command_values[np.maximum(row, 0)]
    offset, amplitude, frequency, stroke, bracket = command.T
    phase = filtered.states[:, 13]
    beat = amplitude * frequency
    u, v, w, p, q, r = (c[name] for name in ("u", "v", "w", "p", "q", "r"))
    plain: dict[str, FloatArray] = {"constant": np.ones_like(u), "time": run.clock / 30.0}
    plain |= {"u": u, "v": v, "w": w, "p": p, "q": q, "r": r}
    plain |= {f"{n}|{n}|": x * np.abs(x) for n, x in zip("uvwpqr", (u, v, w, p, q, r), strict=True)}
    plain |= {"u v": u * v, "u w": u * w, "u q": u * q, "u r": u * r, "v r": v * r, "w q": w * q}
    plain |= {"p r": p * r, "u^3": u**3, "v^3": v**3}
    plain |= {"sin pitch": np.sin(c["pitch"]), "sin roll": np.sin(c["roll"])}
    plain |= {"cos yaw": np.cos(c["yaw"]), "sin yaw": np.sin(c["yaw"])}
    depth = c["z"]
    plain |= {"depth": depth, "depth^2": depth**2, "depth^3": depth**3}
    plain |= {"north": c["x"] - c["x"].mean(), "east": c["y"] - c["y"].mean()}
    plain |= {"beat speed^2": beat**2, "offset beat^2": offset * beat**2, "u beat": u * beat}
    plain |= {"frequency": frequency - frequency.mean(), "amplitude": amplitude - amplitude.mean()}
    plain |= {"block": stroke, "bracket": bracket, "offset": offset}
    waves: tuple[tuple[str, Callable[[FloatArray], FloatArray]], ...] = (
        ("sin", np.sin),
        ("cos", np.cos),
    )
    for harmonic in (1, 2, 3):
        for name, function in waves:
            plain[f"{name} {harmonic} {PHASE}"] = beat**2 * function(harmonic * phase)
    return plain
