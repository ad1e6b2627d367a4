"""The one interface between a vehicle with its measurements and everything that infers.

A problem hands out whitened residuals for a batch of parameter vectors, with the weighting held
that an evaluation at one of them has left. Time series, tables of means and whole runs are three
implementations; ``docs/your-own.md`` shows a fourth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fish_env.arrays import BoolArray, FloatArray, IntArray
from fish_env.inference.estimate.information import block_index
from fish_env.inference.estimate.run_variation import CommonEffect, RunVariation
from fish_env.inference.evaluation import Evaluation, GenericTerms, LackOfFit
from fish_env.inference.hypotheses import Coefficient, EffectName, EffectParameterId
from fish_env.inference.vehicle import (
    Coefficients,
    Drive,
    Effect,
    EffectFreedom,
    finite_values,
    freedoms,
)
from fish_env.inference.work import Work


@dataclass(frozen=True, eq=False)
class Point:
    """Values of all free parameters.

    Attributes:
        z: (n,) baseline coefficients in units of their prior.
        effects: values of the effects in play.
    """

    z: FloatArray
    effects: Mapping[EffectParameterId, float]


class Problem(Protocol):
    """Measured runs of a vehicle, the model that should explain them, and its freedom.

    A subclass must set the attributes and write the methods without a body of their own; what has
    one suits a model that needs nothing special.

    Attributes:
        known: effects by name.
        baseline: coefficients with their priors.
        effects: names of effects that are free from the start.
        hidden_by_drive: effects that put a drive out of step, and that a disturbance may hide.
        late_sensors: effects that make what is measured late.
        longest_step: longest simulation step (s).
        longest_run: length of the longest run (s).
        run_count: number of runs.
        out_of_step: effects that put a periodic drive out of step by more and more; after whole
            periods no small change tells which way to go.
        interchangeable: sets of coefficients that act alike.
        variations: what runs may differ in, K of them.
        common_effects: effects that do in all runs what such numbers do in single ones.
        drive: what was measured of a periodic drive.
        coefficient_step: change of a coefficient (in units of its prior) that slopes are taken by.
        work: what has been simulated; without a limit where nothing is counted.
    """

    known: Mapping[str, Effect]
    baseline: Coefficients
    effects: tuple[str, ...] = ()
    hidden_by_drive: tuple[EffectName, ...] = ()
    late_sensors: tuple[EffectName, ...] = ()
    out_of_step: tuple[EffectName, ...] = ()
    interchangeable: tuple[frozenset[Coefficient], ...] = ()
    variations: tuple[RunVariation, ...] = ()
    common_effects: tuple[CommonEffect, ...] = ()
    drive: Drive = Drive()
    coefficient_step: float = 0.05
    work: Work = Work()

    @property
    def longest_step(self) -> float:
        """Longest simulation step (s)."""
        ...

    @property
    def longest_run(self) -> float:
        """Length of the longest run (s)."""
        ...

    @property
    def run_count(self) -> int:
        """Number of runs."""
        ...

    def groups(self) -> tuple[IntArray, FloatArray]:
        """(D,) run of each residual, and (D,) its time in the run (s)."""
        ...

    def clusters(self) -> IntArray:
        """(D,) number of the cluster of each residual: those of different ones err independently.

        By default blocks of time, each longer than a disturbance lasts.
        """
        return block_index(*self.groups())

    @property
    def noise_is_of_runs(self) -> bool:
        """Whether the noise is how far a run as a whole is off by chance; else runs err besides."""
        return False

    @property
    def measured(self) -> BoolArray:
        """(D,) whether a residual belongs to a value that was measured; others are zero."""
        return np.ones(len(self.groups()[0]), bool)

    def filtered(self, point: Point, noise: Any, near: Sequence[Any] = ()) -> Sequence[Evaluation]:
        """Evaluate every run at one point.

        Args:
            point: values of the parameters.
            noise: noise model.
            near: evaluation at a point close by, where there is one to begin from.
        """
        ...

    def innovations(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: Any,
        filtered: Sequence[Any],
    ) -> FloatArray:
        """Whitened residuals (N, D) of many points under the weighting of an evaluation.

        Args:
            z: (n, N) baseline coefficients in units of their prior.
            effects: effect parameter -> (N,).
            noise: noise model.
            filtered: evaluation whose weighting is held.
        """
        ...

    def lasting(self, filtered: Sequence[Any]) -> Sequence[Any]:
        """What a finished fit keeps of its evaluation: not what only its next step would ask for.

        Args:
            filtered: evaluation of every run.
        """
        return filtered

    @property
    def run_ids(self) -> tuple[str, ...]:
        """What the runs are called."""
        return tuple(str(i) for i in range(self.run_count))

    def some(self, runs: Sequence[int]) -> Problem:
        """The same problem on some of its runs, by their numbers."""
        ...

    def default_noise(self) -> Any:
        """Noise model to begin from."""
        ...

    def fitted_noise(
        self,
        point: Point,
        noise: Any,
        final: bool,
        filtered: Sequence[Any],
        leverage: Callable[[], FloatArray],
    ) -> Any:
        """Noise model of largest likelihood at a point, from the present one.

        Args:
            point: values of the parameters.
            noise: present noise model.
            final: whether the parameters are near their estimates, so that the residuals are noise.
            filtered: evaluation at the point.
            leverage: works out what share of each residual the free parameters follow (D,): of
                few residuals they follow many.
        """
        ...

    def noise_of(self, fit: Any) -> Any:
        """Noise model of a fit to other runs, on these.

        Args:
            fit: to the same vehicle.
        """
        return fit.noise

    def subset(self, count: int) -> Problem:
        """The same problem on at most ``count`` runs, spread over all of them."""
        return self if self.run_count <= count else self.some(self.spread(count))

    def generic_terms(self, fit: Any) -> GenericTerms:
        """Forces for the adequacy test of a fit to this problem."""
        ...

    def lack_of_fit(self, fit: Any) -> LackOfFit | None:
        """How much more a fit misses than repeats of a run differ by; None where that is unknown.

        Args:
            fit: to this problem.
        """
        return None

    def noise_freedom(self, fit: Any) -> float:
        """How many independent residuals say how large the noise is; infinite where it is known.

        Args:
            fit: to this problem.
        """
        return float("inf")

    def changes(
        self,
        z: FloatArray,
        effects: Mapping[EffectParameterId, FloatArray],
        noise: Any,
        filtered: Sequence[Any],
    ) -> FloatArray:
        """What :meth:`innovations` change from the first point to each other (N - 1, D)."""
        rows = self.innovations(z, effects, noise, filtered)
        rows[1:] -= rows[0]  # in place: fresh memory costs as much as the arithmetic
        return rows[1:]

    @property
    def start(self) -> Point:
        """Nominal coefficients, effects where their estimates begin."""
        return Point(np.zeros(len(self.baseline)), self.beginning(self.effects))

    def beginning(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects that estimates can begin from."""
        return finite_values(self.known, self.neutral(names))

    def neutral(self, names: Iterable[str]) -> dict[EffectParameterId, float]:
        """Values of effects where they do nothing beyond the nominal model."""
        return {
            EffectParameterId(name, parameter): value
            for name in names
            for parameter, value in self.known[name].neutral.items()
        }

    def freedoms(self, names: Iterable[str]) -> tuple[EffectFreedom, ...]:
        """Free parameters of effects."""
        step = self.longest_step
        return tuple(f for name in names for f in freedoms(self.known[name], step))

    def spread(self, count: int) -> list[int]:
        """Which runs stand for all: at most ``count`` of them, spread over the list."""
        last = self.run_count - 1
        return sorted(set(np.linspace(0, last, min(count, last + 1)).round().astype(int).tolist()))

    def disturbance_at_limit(self, noise: Any) -> tuple[str, ...]:
        """What of a noise model is at its plausible limit: a misfit with another name."""
        return ()

    @property
    def variation(self) -> FloatArray:
        """(R, K) what each run differs in."""
        return np.zeros((self.run_count, 0))

    def with_variation(
        self, values: FloatArray, point: Point, noise: Any, near: Sequence[Any] = ()
    ) -> Problem:
        """The same problem with other numbers (R, K) of the runs.

        Args:
            values: the numbers.
            point: values of the shared parameters, close to theirs.
            noise: noise model.
            near: evaluation at numbers close by; what follows from the motion is then taken from
                it, and not from the motion that these numbers show. None of a run that keeps its
                numbers and stays as it is.
        """
        return self

    def as_commanded(self) -> Problem:
        """The same problem without what was measured of each run's own drive beforehand."""
        return self

    def variation_slopes(
        self, point: Point, noise: Any, filtered: Sequence[Any], steps: FloatArray
    ) -> FloatArray:
        """(D, K) change of each residual with its own run's numbers.

        Args:
            point: values of the shared parameters.
            noise: noise model.
            filtered: evaluation whose weighting is held.
            steps: (K,) sizes of the differences, SI.
        """
        return np.zeros((len(self.groups()[0]), 0))

    def without_feedback(
        self, filtered: Sequence[Any], noise: Any
    ) -> tuple[Problem, Sequence[Any], IntArray]:
        """Windows of some seconds over which a model runs alone, to judge its predictions.

        Args:
            filtered: evaluation whose states the windows start from.
            noise: noise model; errors count in units of its sensor noise.

        Returns:
            The problem on the windows, an evaluation that corrects nothing, and the run (windows,)
            that each window is of. By default the runs themselves, as they are weighted.
        """
        return self, filtered, np.arange(self.run_count)

    def residual_channels(self) -> tuple[tuple[str, ...], IntArray]:
        """Names of the channels, and (D,) which of them each residual is of."""
        return ("all",), np.zeros(len(self.groups()[0]), np.int64)

    def swamped(self, noise: Any) -> bool:
        """Whether a disturbance is as strong as any that a noise model may have."""
        return False

    @property
    def samples_follow(self) -> bool:
        """Whether samples are put right by the motion estimated, so that settling goes on."""
        return False

    def settled(self, point: Point, noise: Any, nearby: bool = False) -> Problem:
        """The same problem with what is unknown of each run's start where it suits a point.

        Where samples follow the motion, they are those that suit the point.

        Args:
            point: values of the parameters.
            noise: noise model.
            nearby: look only around what suited a point close by.
        """
        return self

    def starts_known(self, further: Iterable[str] = ()) -> bool:
        """Whether nothing has to be settled.

        Args:
            further: effects that a fit is about to begin with.
        """
        return True

    def relaxed_noise(self, noise: Any) -> Any | None:
        """A noise model under which a drive that is out of step is followed; None if there is none.

        Args:
            noise: the present one.
        """
        return None

    def passing_noise(self, noise: Any) -> Any | None:
        """The noise model with a disturbance that passes; None where it is not one that stays.

        Args:
            noise: the present one. A disturbance that stays hides every slow cause.
        """
        return None

    def differing_noise(self) -> Any:
        """Noise model to begin from where each run may differ from the others by what is usual."""
        return self.default_noise()

    def follows_drive(self, noise: Any) -> bool:
        """Whether a noise model follows a drive that is out of step."""
        return False

    def starting_grid(self, name: str) -> Sequence[Mapping[str, float]]:
        """Sizes of an effect so close that from one of them a slope leads to the right one."""
        return ()

    def batch_key(self, names: Iterable[str]) -> object:
        """Settings of effects with the same key are simulated together."""
        return None

    def with_long_steps(self) -> Problem:
        """The same problem in steps that will do to compare causes, with the same freedoms."""
        return self

    def in_usual_steps(self) -> Problem:
        """The same problem in the steps of published estimates."""
        return self

    @property
    def is_coarse(self) -> bool:
        """Whether steps are longer than those of published estimates."""
        return False

    def is_nonsmooth(self, names: Iterable[str]) -> bool:
        """Whether one of these effects makes the motion's rate jump."""
        return False
