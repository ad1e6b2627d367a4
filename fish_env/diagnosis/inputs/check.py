"""The input step of a diagnosis: what is wrong with the data, before any force model is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fish_env.data.retiming import Clocks, retimed
from fish_env.data.schema import Dataset
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clocks import strokes_of
from fish_env.diagnosis.inputs.drive_law import DriveLaw, drive_law
from fish_env.diagnosis.inputs.fine import Fine, fine_clock
from fish_env.diagnosis.inputs.ratios import ratio_near
from fish_env.diagnosis.inputs.search import Found, search
from fish_env.diagnosis.inputs.weighing import BEAT, Scales
from fish_env.diagnosis.policy import CHECKS
from fish_env.errors import DatasetError
from fish_env.identification.beats import own_ratio
from fish_env.identification.recorded import recorded
from fish_env.inference.hypotheses import EffectParameterId
from fish_env.inference.input_faults import InputFault
from fish_env.inference.policy import POLICY
from fish_env.params.io import load_fish
from fish_env.params.schema import FishParams
from fish_env.rigidbody.derived import Derived, derived_channels
from fish_env.rigidbody.noise_floor import noise_floors
from fish_env.rigidbody.policy import RECORDINGS
from fish_env.rigidbody.silence import is_driven, sign_of_motion

SILENCE = "silence"
TIMES = ("clock", "clock_skew", "beat")
PACES = ("frequency_scale", "clock_scale", "clock_skew")
"""Effects by which a fish makes another frequency of the commanded one."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """What the input step found.

    Attributes:
        faults: mistakes, the clearest first.
        dataset: the data with what is decisive put right.
        logged: the data as they were given.
        drive: by how much the tail beats otherwise than commanded in all runs, as effects say it:
            effect parameter -> about its value.
        drive_certain: whether chance is ruled out for that.
    """

    faults: tuple[InputFault, ...]
    dataset: Dataset
    logged: Dataset
    drive: Mapping[EffectParameterId, float] = field(default_factory=dict)
    drive_certain: bool = False

    @property
    def binding(self) -> bool:
        """Whether the verdict is `inputs`."""
        return any(fault.binds for fault in self.faults)

    @property
    def silent(self) -> bool:
        """Whether no channel shows any motion: then there is nothing to explain."""
        return any(fault.kind == SILENCE for fault in self.faults)

    @property
    def beats_corrected(self) -> bool:
        """Whether commands were put right by beats that the swaying of the hull shows."""
        return any(f.kind == "beat" and f.decisive and f.corrected for f in self.faults)

    def as_list(self) -> list[Mapping[str, Any]]:
        """What ``diagnosis.json`` holds under ``inputs``."""
        return [fault.as_dict() for fault in self.faults]


def check_inputs(dataset: Dataset, fish: FishParams | None = None, seed: int = 0) -> Inputs:
    """Look for wrong signs, units, columns, frames, clocks and beats, and for derived channels.

    Of driven runs that hold nothing but white noise, nothing else is asked.

    Args:
        dataset: measured runs.
        fish: the nominal fish; default: the dataset's own.
        seed: of the resampling.
    """
    logged = dataset
    recording = recorded(dataset)
    by_noise = sign_of_motion(recording) if is_driven(recording) else None
    if by_noise is not None and by_noise > RECORDINGS.silent_level:
        return Inputs((_silence(dataset, by_noise),), dataset, logged)
    derived = derived_channels(recording, noise_floors(recording))
    faults = [_derived_fault(one) for one in derived]
    dataset = without(dataset, [one.channel for one in derived])
    nominal, told = as_told(dataset, fish or load_fish(dataset.fish))
    found, right = search(told, Scales(nominal))
    for one in found:
        fault = _fault(one, right)
        faults.append(fault)
        if fault.corrected:
            dataset = one.change.applied(dataset)
    seen = _seen(right, np.random.default_rng([seed, 2]))
    left = [one.change for one in found if _left_to_effects(one.change)]
    if seen.of_runs:  # says the same and more
        faults = [fault for fault in faults if fault.fix not in {change.line for change in left}]
    closer = seen.faults
    faults += closer
    if seen.fine is not None and closer[-1].corrected:
        dataset = seen.fine.change.applied(dataset)
    drive = seen.law.starts(math.prod(change.clocks[""].beat for change in left))
    drive = {id: v for id, v in drive.items() if id.effect not in nominal.effects}
    certain = seen.law.p < CHECKS.certain_law_level
    return Inputs(tuple(faults), _noted(dataset, faults), logged, drive, certain)


@dataclass(frozen=True, eq=False)
class _Seen:
    """What a closer look at clocks and beats finds.

    Attributes:
        law: what the beat does in all runs, and is not put right.
        fine: a small fault of clocks or beats; None where there is none.
    """

    law: DriveLaw
    fine: Fine | None

    @property
    def of_runs(self) -> bool:
        """Whether more is known of the beats than their ratio in all runs."""
        return bool(self.law.sizes) or _of_single_runs(self.fine)

    @property
    def faults(self) -> list[InputFault]:
        """What is told of it, the fine fault last."""
        law = [_law_fault(self.law)] if self.law.sizes else []
        return law if self.fine is None else [*law, _fine_fault(self.fine)]


def _seen(right: Dataset, rng: np.random.Generator) -> _Seen:
    law = drive_law(right)
    lawful = bool(law.sizes)
    fine = fine_clock(law.following(right), rng, lawful)
    # Ratios of single runs hold what they have in common, unless a law does.
    held = not lawful and _of_single_runs(fine)
    return _Seen(replace(law, common=1.0) if held else law, fine)


def _of_single_runs(fine: Fine | None) -> bool:
    return fine is not None and "" not in fine.change.clocks


def _left_to_effects(change: Change) -> bool:
    """Whether a change is a beat in all runs that is put right to look on, but not in the data."""
    return _ordinary(change) and "" in change.clocks


def as_told(dataset: Dataset, fish: FishParams) -> tuple[FishParams, Dataset]:
    """The fish without pace of its own, and the commands as it beats to them.

    A fish file that knows its frequency is off makes no fault of it.
    """
    own = own_ratio(fish)
    if own == 1.0:
        return fish, dataset
    effects = {name: values for name, values in fish.effects.items() if name not in PACES}
    runs = tuple(retimed(run, Clocks(beat=own)) for run in dataset.runs)
    return replace(fish, effects=effects), replace(dataset, runs=runs)


def refuse_wrong_inputs(dataset: Dataset, fish: FishParams | None = None) -> None:
    """Refuse data with a mistake that no fit survives.

    Args:
        dataset: measured runs.
        fish: the nominal fish; default: the dataset's own.

    Raises:
        DatasetError: Names the mistake and the line of dataset.yaml to write.
    """
    for fault in check_inputs(dataset, fish).faults:
        if fault.binds:
            raise DatasetError(f"{dataset.name}: {fault.said}")


def without(dataset: Dataset, channels: Sequence[str]) -> Dataset:
    """A dataset without some of its channels."""
    if not channels:
        return dataset
    runs = tuple(
        replace(run, channels={n: a for n, a in run.channels.items() if n not in channels})
        for run in dataset.runs
    )
    noise = {name: sd for name, sd in dataset.noise.items() if name not in channels}
    return replace(dataset, runs=runs, noise=noise)


def _noted(dataset: Dataset, faults: Sequence[InputFault]) -> Dataset:
    said = tuple(f"inputs: {fault.words}" for fault in faults if fault.corrected)
    return replace(dataset, notes=(*dataset.notes, *said)) if said else dataset


def _silence(dataset: Dataset, p: float) -> InputFault:
    words = (
        "no channel shows a motion: all hold white noise only, in which chance makes as strong a "
        f"sign of one with p = {p:.2g}. So no cause was searched for. Check that the sensors were "
        "on, and which columns dataset.yaml names"
    )
    return InputFault(
        SILENCE, ", ".join(dataset.channels), None, "", None, p, None, "", words, "", None, None,
        corrected=False,
    )  # fmt: skip


def _derived_fault(one: Derived) -> InputFault:
    sources = ", ".join(one.sources)
    return InputFault(
        "derived", one.channel, None, "", None, 0.0, None, f"delete {one.channel} under channels",
        f"{one.channel} was computed from {sources} and adds no information, so it is left "
        "out", f"{one.channel} against {sources}", None, None, (), True, False, True,
    )  # fmt: skip


def _law_fault(law: DriveLaw) -> InputFault:
    """What a law of the beat says: nothing to put right, the drive itself does so."""
    return InputFault(
        "beat", "tail_frequency", None, "-", None, law.p, None, "", law.words, BEAT, None, None,
        decisive=True, binds=False, corrected=False,
    )  # fmt: skip


def _fault(one: Found, right: Dataset) -> InputFault:
    change = one.change
    ordinary = _ordinary(change)
    return InputFault(
        change.kind, change.target, change.value, change.unit,
        _interval(change, right), one.p, one.gain, change.line, change.words,
        one.comparison, one.before, one.after, tuple(rival.line for rival in one.rivals),
        decisive=True, binds=not ordinary, corrected=not _left_to_effects(change),
    )  # fmt: skip


def _ordinary(change: Change) -> bool:
    """Whether a beat is no further off than servos are, as `frequency_scale` describes them."""
    ratios = [clocks.beat for clocks in change.clocks.values()]
    return change.kind == "beat" and all(abs(r - 1.0) < CHECKS.servo_beat_error for r in ratios)


def _interval(change: Change, right: Dataset) -> tuple[float, float] | None:
    """95 % interval of a scale of time, by the beat in the data that were put right."""
    if change.kind not in TIMES or change.value is None or len(change.clocks) > 1:
        return None
    left = ratio_near(list(strokes_of(right).values()))
    if left is None:
        return None
    error = float(np.hypot(left.sd, CHECKS.ratio_bias))
    half = POLICY.interval_reach * error
    return change.value * (1.0 - half), change.value * (1.0 + half)


def _fine_fault(fine: Fine) -> InputFault:
    change, ordinary = fine.change, _ordinary(fine.change)
    words = change.words
    # A beat that differs from run to run is taken as measured; a common one is an effect.
    uneven = change.kind == "beat" and "" not in change.clocks
    is_clock = change.kind != "beat"
    if ordinary and not uneven:
        words += "; a servo does that too, which `frequency_scale` and `battery_sag` describe"
    return InputFault(
        change.kind, change.target, change.value, change.unit, fine.interval, fine.p, None,
        change.line, words, BEAT, None, None, tuple(rival.line for rival in fine.rivals),
        decisive=fine.sure and (uneven or is_clock or not ordinary),
        binds=fine.sure and not ordinary, corrected=uneven or (is_clock and fine.sure),
    )  # fmt: skip
