"""What kinematics alone says about the catalogue's effects of measurement, in numbers and words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from fish_env.rigidbody.kinematic_fit import (
    POWER_80,
    Estimate,
    Tested,
    fit_relation,
)
from fish_env.rigidbody.kinematics import ANGLES, POSITIONS, RATES, VELOCITIES, relations_of
from fish_env.rigidbody.noise_floor import Floor, noise_floors
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.recording import Recording

_TURNING, _MOVING = (*ANGLES, *RATES), (*POSITIONS, *ANGLES, *VELOCITIES)
NEEDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "gyro_bias": (_TURNING,),
    "attitude_misalignment": (_TURNING, _MOVING),
    "clock_scale": (_TURNING,),
    "clock_skew": (),
    "position_scale": (_MOVING,),
    "sensor_delay": (),
    "depth_bias": (),
    "camera_tilt": (),
    "gyro_scale": (),
    "imu_lowpass": (),
    "marker_offset": (),
    "refraction": (),
    "soft_iron": (),
}
"""Sets of channels, each of which lets kinematics show an effect; none for what it never shows."""

NEVER = {
    "clock_skew": "without the commands it looks like a clock_scale",
    "sensor_delay": "all channels share the delay, so only the commands can show it",
    "depth_bias": "no other channel contradicts a shifted depth",
}
LATER = (
    "camera_tilt",
    "gyro_scale",
    "imu_lowpass",
    "marker_offset",
    "refraction",
    "soft_iron",
)
"""Effects that this test has no setting for; fits of the motion look for them."""
LOOKS_ALIKE = {
    "clock_scale": "`clock_skew`, or a gyro with a wrong gain (`gyro_scale`)",
    "attitude_misalignment": "a misaligned gyro",
    "position_scale": "velocities with a wrong gain",
}
"""What the catalogue does not know and kinematics cannot tell from its effects."""
_SOURCES: dict[str, dict[str, tuple[str, ...]]] = {
    "gyro_bias": {a: (f"attitude.bias_{a}", f"start.{a}") for a in RATES},
    "attitude_misalignment": {
        a: (f"attitude.{a}_offset", f"position.{a}_offset", f"start.{a}") for a in ANGLES
    },
    "clock_scale": {"scale": ("attitude.scale",)},
    "position_scale": {"scale": ("position.scale",)},
}
"""Which settings tell each parameter, the best first."""

AT_REST = {
    **dict.fromkeys(("roll", "pitch"), 0.02),
    **dict.fromkeys(RATES, 0.01),
    **dict.fromkeys(VELOCITIES, 0.003),
}
"""How far from level and still a run may begin that is declared to begin at rest (rad, rad/s, m/s),
as the identification takes it."""
_UNITS = {**dict.fromkeys(ANGLES, "rad"), **dict.fromkeys(RATES, "rad/s"),
          **dict.fromkeys(VELOCITIES, "m/s")}  # fmt: skip


@dataclass(frozen=True)
class Shown:
    """What kinematics says about one effect of measurement.

    Attributes:
        effect: its name in the catalogue.
        testable: whether these channels could show it.
        found: whether they do.
        parameters: the effect's parameters as far as they were estimated.
        needs: channels that would have to be measured too, the shortest list; empty if testable,
            or if no channel would help.
        words: in a sentence.
    """

    effect: str
    testable: bool
    found: bool
    parameters: Mapping[str, Estimate]
    needs: tuple[str, ...]
    words: str


@dataclass(frozen=True)
class Consistency:
    """Result of step 2.

    Attributes:
        channels: that are measured.
        tested: relations that these channels allow, fitted.
        effects: the catalogue's effects of measurement.
        floors: noise floors of the channels, which the fits are weighted by.
    """

    channels: tuple[str, ...]
    tested: tuple[Tested, ...]
    effects: tuple[Shown, ...]
    floors: tuple[Floor, ...] = field(repr=False)

    @property
    def found(self) -> tuple[str, ...]:
        """Effects that need no force model to be seen."""
        return tuple(shown.effect for shown in self.effects if shown.found)

    @property
    def unnamed(self) -> tuple[Estimate, ...]:
        """Contradictions between channels that no effect of the catalogue describes."""
        told = {e.name: e for shown in self.effects for e in shown.parameters.values()}
        every = [e for relation in self.tested for e in relation.estimates if e.found]
        return tuple(e for e in every if e.name not in told and not _explained(e, told.values()))


def _explained(start: Estimate, told: Iterable[Estimate]) -> bool:
    """Whether a reading at the start is what an effect that was found makes of it."""
    if not start.name.startswith("start."):
        return False
    name, sure = start.name.removeprefix("start."), RECORDINGS.same_reading_sd
    return any(
        e.found and abs(e.value - start.value) < sure * np.hypot(e.error, start.error)
        for e in told
        if e.name.endswith((f"bias_{name}", f"{name}_offset"))
    )


def check_consistency(
    recording: Recording,
    rng: np.random.Generator,
    floors: Sequence[Floor] | None = None,
    draws: int = RECORDINGS.consistency_draws,
) -> Consistency:
    """Step 2 of a diagnosis: do the channels agree among themselves?

    Args:
        recording: measured runs.
        rng: for the resampling.
        floors: noise floors, if they are known already.
        draws: number of draws that p-values come from.
    """
    known = tuple(floors) if floors is not None else noise_floors(recording)
    noise = {f.channel: f.white.sd for f in known if f.white is not None and f.white.sd > 0.0}
    relations = [r for r in relations_of(recording.channels) if {*r.outputs, *r.inputs} <= {*noise}]
    start = _has_start(recording, noise)
    sharing = len(relations) + start
    tested = [fit_relation(recording, r, noise, rng, sharing, draws) for r in relations]
    if start:
        tested.append(read_starts(recording, noise, sharing))
    effects = tuple(_shown(name, recording.channels, tested) for name in NEEDS)
    return Consistency(recording.channels, tuple(tested), effects, known)


def _has_start(recording: Recording, noise: Mapping[str, float]) -> bool:
    from_rest = any(run.from_rest for run in recording.runs)
    return from_rest and any(name in AT_REST for name in noise)


def read_starts(recording: Recording, noise: Mapping[str, float], sharing: int = 1) -> Tested:
    """Whether runs that are declared to begin level and at rest do so, by their first samples."""
    runs = [run for run in recording.runs if run.from_rest]
    names = [name for name in AT_REST if name in noise]
    estimates = []
    for name in names:
        first = np.array([run.channels[name][0] for run in runs])
        first = first[np.isfinite(first)]
        if not first.size:
            continue
        error = float(np.hypot(noise[name], AT_REST[name]) / np.sqrt(first.size))
        p = _chance(first.mean() / error, sharing * len(names))
        critical = _quantile(RECORDINGS.consistency_level / (sharing * len(names)))
        words = f"{name} reads this where a run is declared to begin level and at rest"
        estimates.append(
            Estimate(f"start.{name}", _UNITS[name], words, float(first.mean()), error, p,
                     (critical + POWER_80) * error)
        )  # fmt: skip
    return Tested("start", tuple(names), False, len(runs), 0.0, tuple(estimates), float("nan"))


def _chance(t: float, tests: int) -> float:
    """Two-sided p of a normal score among a number of tests."""
    return float(min(1.0, 2.0 * tests * ndtr(-abs(t))))


def _quantile(p: float) -> float:
    """Two-sided critical value of a normal score."""
    return float(-ndtri(0.5 * p))


def _shown(effect: str, channels: Sequence[str], tested: Sequence[Tested]) -> Shown:
    known = {e.name: e for relation in tested for e in relation.estimates}
    sources = _SOURCES.get(effect, {})
    parameters = {
        parameter: next(known[name] for name in names if name in known)
        for parameter, names in sources.items()
        if any(name in known for name in names)
    }
    if effect == "position_scale" and "attitude.scale" in known and parameters:
        parameters = {"scale": _ratio(parameters["scale"], known["attitude.scale"])}
    found = any(e.found for e in parameters.values())
    needs = () if parameters else _missing(effect, channels)
    return Shown(effect, bool(parameters), found, parameters, needs,
                 _words(effect, parameters, needs, found))  # fmt: skip


def _ratio(position: Estimate, clock: Estimate) -> Estimate:
    """Scale of the positions beyond what a wrong clock does to every path."""
    if not clock.found:
        return position
    value, error = position.value - clock.value, float(np.hypot(position.error, clock.error))
    p, detectable = _chance(value / error, 20), position.detectable * error / position.error
    return replace(position, value=value, error=error, p=p, detectable=detectable)


def _missing(effect: str, channels: Sequence[str]) -> tuple[str, ...]:
    lacking = [tuple(c for c in needed if c not in channels) for needed in NEEDS[effect]]
    return min(lacking, key=len, default=())


def _words(
    effect: str, parameters: Mapping[str, Estimate], needs: Sequence[str], found: bool
) -> str:
    if effect in NEVER:
        return f"{effect}: kinematics cannot show it; {NEVER[effect]}."
    if effect in LATER:
        return f"{effect}: not tested here; fits of the motion look for it."
    if not parameters and needs:
        return f"{effect}: not detectable without {', '.join(needs)}."
    if not parameters:
        return f"{effect}: the runs are too short, or have too many gaps, to test it."
    if found:
        sizes = [f"{name} {_value(e)}" for name, e in parameters.items() if e.found]
        other = f", or {LOOKS_ALIKE[effect]}" if effect in LOOKS_ALIKE else ""
        return f"{effect}{other}: the channels contradict each other by {', '.join(sizes)}."
    limits = [f"{name} {e.detectable:.2g} {_unit(e)}".rstrip() for name, e in parameters.items()]
    return f"{effect}: not seen; a size of {', '.join(limits)} is found with power 0.8."


def _unit(estimate: Estimate) -> str:
    return "" if estimate.unit == "-" else estimate.unit


def _value(e: Estimate) -> str:
    return f"{e.value:+.3g} ± {1.96 * e.error:.2g} {_unit(e)}".rstrip()


def sentences(consistency: Consistency) -> list[str]:
    """What a reader should know, the findings first."""
    relations = [r for r in consistency.tested if r.name != "start" and r.estimates]
    said = [shown.words for shown in consistency.effects if shown.found]
    said += [_unnamed(e) for e in consistency.unnamed]
    if not relations:
        said.append(_nothing_to_compare(consistency))
    for relation in relations:
        agree = not any(e.found for e in relation.estimates)
        if agree:
            said.append(f"{', '.join(relation.channels)} agree with each other.")
        if relation.level:
            said.append("Roll and pitch are not measured; the fish is assumed to be level.")
    said += [s.words for s in consistency.effects if not s.found and (s.testable or s.needs)]
    return said


def _unnamed(e: Estimate) -> str:
    if e.name.startswith("start."):
        remedy = "declare `start: unknown` unless it is the sensor that is off"
    else:
        remedy = "no effect of the catalogue describes it, so correct the data"
    return f"{e.name}: {e.words}: {_value(e)}; {remedy}."


def _nothing_to_compare(consistency: Consistency) -> str:
    short = [r for r in consistency.tested if r.name != "start"]
    if short:
        fewest = RECORDINGS.fewest_consistency_windows
        return (
            f"The runs are too short to compare {', '.join(short[0].channels)} with each other: "
            f"fewer than {fewest} windows of {short[0].window_s:g} s."
        )
    return (
        f"No kinematic relation connects {', '.join(consistency.channels)}, so these channels "
        "alone cannot show a biased, scaled or late sensor."
    )


def as_dict(consistency: Consistency) -> dict[str, Any]:
    """What ``diagnosis.json`` holds of step 2."""
    return {
        "level": RECORDINGS.consistency_level,
        "relations": [_relation(r) for r in consistency.tested],
        "effects": [
            {
                "name": shown.effect,
                "testable": shown.testable,
                "found": shown.found,
                "parameters": {n: _estimate(e) for n, e in shown.parameters.items()},
                "needs": list(shown.needs),
            }
            for shown in consistency.effects
        ],
        "sentences": sentences(consistency),
    }


def _relation(relation: Tested) -> dict[str, Any]:
    return {
        "name": relation.name,
        "channels": list(relation.channels),
        "taken_level": relation.level,
        "windows": relation.windows,
        "window_s": relation.window_s,
        "left": relation.left if np.isfinite(relation.left) else None,
        "estimates": [_estimate(e) for e in relation.estimates],
    }


def _estimate(e: Estimate) -> dict[str, Any]:
    return {
        "name": e.name,
        "unit": e.unit,
        "estimate": e.value,
        "standard_error": e.error,
        "p": e.p,
        "found": e.found,
        "smallest_detectable": e.detectable,
    }
