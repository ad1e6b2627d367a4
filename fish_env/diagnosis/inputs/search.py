"""Search for other readings of a dataset under which it agrees with itself and its commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fish_env.data.schema import Dataset
from fish_env.data.vocabulary import COMMANDS
from fish_env.diagnosis.inputs.changes import Change
from fish_env.diagnosis.inputs.clocks import changes_of_clocks
from fish_env.diagnosis.inputs.library import readings
from fish_env.diagnosis.inputs.responses import AGAINST
from fish_env.diagnosis.inputs.weighing import BEAT, Scales, Weighed
from fish_env.diagnosis.policy import CHECKS


@dataclass(frozen=True, eq=False)
class Found:
    """One mistake, with what speaks for it.

    Attributes:
        change: what puts it right.
        gain: log likelihood gained.
        p: bound on the probability of such a gain by chance, for the best of all readings tried.
        comparison: which comparison it improves most.
        before: disagreement of that comparison as declared.
        after: disagreement with the change.
        rivals: other changes that explain as much.
    """

    change: Change
    gain: float
    p: float
    comparison: str
    before: float
    after: float
    rivals: tuple[Change, ...]

    @property
    def decisive(self) -> bool:
        """Whether chance cannot have made it, and no other reading than it or its rivals can."""
        enough = bool(self.change.clocks) or self.after < CHECKS.most_left * self.before
        falls = self.before - self.after > CHECKS.least_fall
        return self.p < CHECKS.input_fault_level and falls and enough


def search(dataset: Dataset, scales: Scales) -> tuple[list[Found], Dataset]:
    """Mistakes in a dataset, the clearest first, and the dataset without them.

    Args:
        dataset: as it is declared.
        scales: to weigh readings of it.
    """
    found: list[Found] = []
    now = scales.weigh(dataset)
    while len(found) < CHECKS.most_input_faults:
        best = best_reading(dataset, scales, now, readings(dataset))
        if best is None or not best.decisive:
            return found, dataset
        found.append(best)
        dataset = best.change.applied(dataset)
        now = scales.weigh(dataset)
    return found, dataset


def best_reading(
    dataset: Dataset, scales: Scales, now: Weighed, every: Sequence[Change]
) -> Found | None:
    """The reading that explains most more than the present one; None if none is in question.

    Args:
        dataset: as it is read now.
        scales: to weigh it.
        now: what it weighs.
        every: readings of its columns; those of its clocks are found from the data.
    """
    tried = [change for change in every if _questioned(change, now)]
    tried += changes_of_clocks(dataset, scales, now)
    read = ((change, change.applied(dataset)) for change in tried)
    weighed = [(c, scales.weigh(data)) for c, data in read if not c.commands or _possible(data)]
    if not weighed:
        return None
    gains = np.array([now.gain(other) for _, other in weighed])
    first, rival = int(np.argmax(gains)), CHECKS.rival_reading
    beats = [i for i, (c, _) in enumerate(weighed) if c.kind == "beat" and "" in c.clocks]
    if weighed[first][0].kind in ("clock", "beat") and beats:
        # A beat is the smaller claim where the data cannot tell it from a clock.
        first = beats[0] if gains[beats[0]] > gains[first] - rival else first
    change, after = weighed[first]
    gain = float(gains[first])
    rivals = tuple(
        other for (other, _), g in zip(weighed, gains, strict=True)
        if other is not change and g > gain - rival
    )  # fmt: skip
    p = float(min(1.0, (len(every) + CHECKS.clocks_tried) * np.exp(-max(gain, 0.0))))
    own = change.clocks.keys() - {""}
    pair = (now.of_runs(own), after.of_runs(own)) if own else (now, after)
    return Found(change, gain, p, *pair[0].clearest(pair[1]), rivals)


def _questioned(change: Change, now: Weighed) -> bool:
    """Whether a comparison that a change may touch is bad."""
    enough = CHECKS.suspicious_disagreement
    bad = {name for name, value in now.disagreement.items() if value > enough and name != BEAT}
    if change.commands and any(name.endswith(AGAINST) for name in bad):
        return True
    return any(set(now.comparisons[name].channels) & change.channels.keys() for name in bad)


def _possible(dataset: Dataset) -> bool:
    """Whether commands are what servos can be asked: a reading does not make amplitudes negative.

    Where a tail is not told to beat nothing is compared, so that such a reading might seem better.
    """
    lower, upper = np.array([(c.lower, c.upper) for c in COMMANDS.values()]).T
    read = [run.commands.values for run in dataset.runs]
    return all(bool(np.all((values >= lower) & (values <= upper))) for values in read)
