"""Fits with one more cause: sketched for all that deserve it, in full for the few that lead."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from fish_env.diagnosis.adequacy import strains
from fish_env.diagnosis.effort import FULL, Effort
from fish_env.diagnosis.explanation import Explanation, reached
from fish_env.diagnosis.projection import Signal
from fish_env.diagnosis.starts import baselines, probed, starts
from fish_env.effects.extended import PREFIX
from fish_env.identification.estimator import Fit, fit
from fish_env.identification.filtering import NoiseModel
from fish_env.identification.problem import Point, Problem
from fish_env.identification.side_by_side import side_by_side
from fish_env.identification.sketch import Sketch, Sketcher

FloatArray = npt.NDArray[np.float64]
Report = Callable[[str], None]
Sketched = tuple[str, Sketch]
"""With the name of the cause that it has added."""
Way = Callable[[float, Signal], list[Sketched]]
"""To sketch a cause, no further than it takes to see that it stays above an objective."""
BEHIND = 0.25
"""A sketch that gains less by more than this share of the best one's gain is not fitted in full."""
LEEWAY = 100.0
"""... unless the difference in -2 log likelihood is smaller than this: sketches are not fits."""
TELLING = 2.0
"""What a sketch gains by one more parameter that does nothing, at most as a rule (Akaike, 1974)."""
HOPELESS = 1000.0
"""A fit that cannot come this near to the leader's is no rival, however coloured what is left."""


def refits(
    current: Explanation,
    chosen: Sequence[Signal],
    report: Report,
    loose: tuple[Fit, Sequence[Signal]] | None = None,
    effort: Effort = FULL,
    like: Callable[[str], Sequence[Signal]] = lambda name: (),
    unseen: Sequence[Signal] = (),
) -> tuple[list[Explanation], Explanation | None]:
    """Fits with one more cause each, best first, and the present one under the best one's noise.

    All share the noise model that the best of them leaves: the disturbance it needs is the
    smallest, and only under one yardstick can fits be compared.

    Args:
        current: causes accepted so far.
        chosen: causes to add.
        report: told what is being done.
        loose: fit with a wandering phase, and what it shows to be missing.
        effort: how many causes to try beside the chosen ones, and to fit in full.
        like: further causes known to look like one, which are tried if it leads.
        unseen: causes to add that may hide from the screen.
    """
    if not chosen:
        return [], None
    base = current.fit
    sketcher = Sketcher(base)
    wandering, shown = loose or (base, ())
    follower = Sketcher(wandering)

    def followed(enough: float, signal: Signal) -> list[Sketched]:
        report(f"trying {signal.cause.name} with a wandering phase")
        first = _sketches(follower, base, signal, starts(wandering, signal))
        return [s for _, f in first for s in _sketches(sketcher, base, signal, [f.point], enough)]

    def alone(enough: float, signal: Signal) -> list[Sketched]:
        report(f"trying {signal.cause.name}")
        return _sketches(sketcher, base, signal, starts(base, signal), enough)

    def also(way: Way, signals: Sequence[Signal]) -> list[Sketched]:
        enough = _enough(sketches, sketcher.base, BEHIND, effort.finalists)
        return _all([partial(way, enough, signal) for signal in signals])

    sketches: list[Sketched] = []
    for way, signals in ((alone, chosen), (followed, shown), (alone, unseen)):
        sketches += also(way, signals)
    if sketches:
        ahead = min(sketches, key=lambda s: s[1].objective)[0]
        sketches += also(alone, like(ahead)[: effort.shortlist])
    settled = bool(current.causes) and not strains(base)
    if settled:
        sketches = _telling(sketcher, sketches, {signal.cause.name for signal in chosen})
    finalists = _finalists(sketches, sketcher.base, BEHIND, effort.finalists)
    found = (_gaining if settled else _led)(current, finalists, report)
    if not found:
        return [], None
    tried, noise = _best_first(found, None if settled else found[0])
    # A baseline that diverges under the smaller disturbance keeps the one that suits it.
    return tried, Explanation(current.causes, _at_noise(base.problem, base, noise, 2) or base)


def _all(tasks: Iterable[Callable[[], list[Sketched]]]) -> list[Sketched]:
    return [sketch for found in side_by_side(tasks) for sketch in found]


def second_look(
    current: Explanation, tried: list[Explanation], chosen: Sequence[Signal], report: Report
) -> list[Explanation]:
    """The same contest, seen from its winner: it may have won from where the misfit had led.

    Baseline coefficients near a good explanation are near those of a better one, and so is the
    disturbance; from there, every other cause is sketched in the winner's place.

    Args:
        current: causes accepted before the contest.
        tried: result of the contest, best first.
        chosen: causes to put in the winner's place.
        report: told what is being done.
    """
    best = tried[0].fit
    sketcher = Sketcher(best)
    enough = sketcher.base + LEEWAY
    done = {e.causes[-1] for e in tried}

    def again(signal: Signal) -> list[Sketched]:
        report(f"trying {signal.cause.name} again")
        begin = starts(current.fit, signal, best.point.z)
        return _sketches(sketcher, current.fit, signal, begin, enough)

    others = [s for s in chosen if s.cause.is_effect and s.cause.name not in done]
    sketches = _all(partial(again, s) for s in others)
    finalists = _finalists(sketches, sketcher.base, 0.0, FULL.finalists)
    finalists = [f for f in finalists if f[1].objective < enough]
    more = _rest(current, finalists, best, report)
    return _best_first([*tried, *more], tried[0])[0]


def exchanged(current: Explanation, left: Sequence[Signal], report: Report) -> list[Explanation]:
    """The explanation, and one that has a look-alike in the place of an earlier cause, best first.

    The first cause is chosen while the others are still missing, and its nearest relative may then
    make up for part of them.

    Args:
        current: at least two causes; the last one was chosen in view of the others.
        left: what every other effect would still explain.
        report: told what is being done.
    """
    own = current.fit
    sketcher = Sketcher(own)
    found: list[tuple[float, tuple[str, ...], Sketch]] = []
    for name in current.causes[:-1]:
        alike = own.problem.known[name].confusable_with if name in own.effects else ()
        for signal in (s for s in left if s.cause.name in alike):
            report(f"trying {signal.cause.name} instead of {name}")
            causes = tuple(signal.cause.name if c == name else c for c in current.causes)
            sketch = _exchange(sketcher, own, name, signal)
            if sketch is not None:
                found.append((sketch.objective, causes, sketch))
    if not found:
        return [current]
    _, causes, sketch = min(found, key=lambda f: f[0])
    if sketch.objective >= sketcher.base + LEEWAY:
        return [current]
    report(f"fitting {' and '.join(causes)}")
    fitted = _in_full(own.problem, sketch, own.noise)
    if fitted is None:
        return [current]
    both = [current, Explanation(causes, fitted)]
    return sorted(both, key=lambda e: e.score)


def _exchange(sketcher: Sketcher, own: Fit, name: str, signal: Signal) -> Sketch | None:
    """The sketch with one effect in the place of another, from all its sizes.

    One that ends switched off had begun too far away, and is tried from each size in turn.
    """
    kept = {p: v for p, v in own.point.effects.items() if p.split(".")[1] != name}
    effects = tuple(signal.cause.name if e == name else e for e in own.effects)
    sizes = probed(own.problem, signal, every=True)
    begin = [Point(z, {**kept, **values}) for z in baselines(own) for values in sizes]
    sketches = [reached(partial(sketcher.sketch, effects, own.released, begin))]
    if sketches[0] is None or _off(own.problem, sketches[0].point, signal.cause.name):
        sketches += [reached(partial(sketcher.sketch, effects, own.released, [b])) for b in begin]
    return min((s for s in sketches if s), key=lambda s: s.objective, default=None)


def without(current: Explanation, name: str) -> Explanation | None:
    """The fit when one of its causes is dropped, under the same noise model.

    None where the simulation diverges without it.
    """
    own = current.fit
    effects = tuple(e for e in own.effects if e != name)
    released = tuple(p for p in own.released if f"parameter:{p}" != name)
    values = {p: v for p, v in own.point.effects.items() if p.split(".")[1] != name}
    begin = Point(own.point.z, values)
    smaller = reached(
        lambda: fit(
            own.problem, effects, begin, own.noise, released, refit_noise=False, iterations=4
        )
    )
    if smaller is None:
        return None
    return Explanation(tuple(c for c in current.causes if c != name), smaller)


def _sketches(
    sketcher: Sketcher,
    base: Fit,
    signal: Signal,
    begin: Sequence[Point],
    hopeless: float = np.inf,
) -> list[Sketched]:
    """The sketch of one cause; none where the simulation diverges from every start.

    Where the few runs of a sketch show nothing of an effect it may end switched off, and the
    estimate from all runs, the first start, is the better one to fit it from.
    """
    cause = signal.cause
    effects = (*base.effects, cause.name) if cause.is_effect else base.effects
    released = base.released if cause.is_effect else (*base.released, cause.path or "")
    found = reached(lambda: sketcher.sketch(effects, released, begin, hopeless))
    if found is None:
        return []
    if cause.is_effect and _off(base.problem, found.point, cause.name):
        found = replace(found, point=begin[0])
    return [(cause.name, found)]


def _off(problem: Problem, point: Point, name: str) -> bool:
    """Whether an effect does nothing at a point."""
    switching = problem.known[name].switching
    return all(point.effects[f"{PREFIX}{name}.{p.name}"] == p.neutral for p in switching)


def _finalists(sketches: list[Sketched], base: float, behind: float, most: int) -> list[Sketched]:
    """The sketches that may still be the best fit, best first."""
    if not sketches:
        return []
    ranked = sorted(sketches, key=lambda s: s[1].objective)
    first = {name: i for i, (name, _) in reversed(list(enumerate(ranked)))}
    ranked = [ranked[i] for i in sorted(first.values())]  # a cause may have several
    enough = _enough(ranked, base, behind, most)
    return [s for s in ranked[:most] if s[1].objective <= enough]


def _enough(sketches: list[Sketched], base: float, behind: float, most: int) -> float:
    """Objective up to which a sketch may be a finalist, however far others will yet get."""
    best = min((s.objective for _, s in sketches), default=np.inf)
    return best if most == 1 else best + max(LEEWAY, behind * (base - best))


def _telling(sketcher: Sketcher, sketches: list[Sketched], seen: Collection[str]) -> list[Sketched]:
    """Sketches of what the screen has seen, and of what gains on their runs where it has not."""
    if all(name in seen for name, _ in sketches):
        return sketches
    own = sketcher.fit
    alone = sketcher.sketch(own.effects, own.released, [own.point])
    enough = alone.objective - TELLING
    return [(name, s) for name, s in sketches if name in seen or s.objective < enough]


def _led(current: Explanation, finalists: list[Sketched], report: Report) -> list[Explanation]:
    """Full fits under the noise that the likeliest of them leaves, which comes first."""
    base, left = current.fit, [*finalists]
    while left:
        name, sketch = left.pop(0)
        report(f"fitting {name}")
        leader = _in_full(base.problem, sketch, base.noise)
        if leader is not None:
            first = Explanation((*current.causes, name), leader)
            return [first, *_rest(current, left, leader, report)]
    return []


def _gaining(current: Explanation, finalists: list[Sketched], report: Report) -> list[Explanation]:
    """Full fits under the present noise; none of them where none explains more than there is.

    Where no misfit drives the disturbance, one more cause hardly changes it: its model will do to
    see whether what showed was chance.
    """
    found = _rest(current, finalists, current.fit, report)
    return found if any(e.score < current.score for e in found) else []


def _rest(
    current: Explanation, finalists: list[Sketched], leader: Fit, report: Report
) -> list[Explanation]:
    """Full fits under the leader's noise, as far as they may come near the leader's."""
    hopeless = leader.objective + HOPELESS

    def fitted(name: str, sketch: Sketch) -> Explanation | None:
        report(f"fitting {name}")
        found = _at_noise(leader.problem, sketch, leader.noise, 4, hopeless)
        return None if found is None else Explanation((*current.causes, name), found)

    tasks = [partial(fitted, name, sketch) for name, sketch in finalists]
    return [explanation for explanation in side_by_side(tasks) if explanation]


def _best_first(
    tried: list[Explanation], leader: Explanation | None
) -> tuple[list[Explanation], NoiseModel]:
    """Explanations by score, the first with the noise it leaves, and the others under that.

    Args:
        tried: explanations under one noise model.
        leader: the one that has left it, if one of them has.
    """
    ranked = sorted(tried, key=lambda e: e.score)
    own = ranked[0].fit
    problem = own.problem
    first = None if ranked[0] is leader else _noise_too(problem, own)
    if first is None:
        return ranked, own.noise
    tasks = [partial(_at_noise, problem, e.fit, first.noise, 2) for e in ranked[1:]]
    pairs = zip(ranked[1:], side_by_side(tasks), strict=True)
    others = [Explanation(e.causes, fitted) for e, fitted in pairs if fitted]
    return [Explanation(ranked[0].causes, first), *others], first.noise


def _in_full(problem: Problem, sketch: Sketch, noise: NoiseModel) -> Fit | None:
    few = problem.subset(3)
    first = reached(
        lambda: fit(few, sketch.effects, sketch.point, noise, sketch.released, rounds=1)
    )
    return first if first is None or few is problem else _noise_too(problem, first)


def _at_noise(
    problem: Problem,
    at: Sketch | Fit,
    noise: NoiseModel,
    iterations: int,
    hopeless: float = np.inf,
) -> Fit | None:
    return reached(
        lambda: fit(
            problem, at.effects, at.point, noise, at.released, refit_noise=False,
            iterations=iterations, hopeless=hopeless,
        )
    )  # fmt: skip


def _noise_too(problem: Problem, own: Fit) -> Fit | None:
    free = (own.effects, own.point, own.noise, own.released)
    return reached(lambda: fit(problem, *free, rounds=2))
