"""Where values come from, and what an identification knew about them."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Literal, get_args

Status = Literal["published", "reconstructed", "identified"]
STATUSES: tuple[str, ...] = get_args(Status)


@dataclasses.dataclass(frozen=True)
class Origin:
    """Status and source of a value.

    Attributes:
        status: `published` (printed with the fish), `reconstructed` (chosen so that the model moves
            as reported) or `identified` (estimated from measured runs).
        source: Where it stands or how it was obtained, in words.
    """

    status: Status
    source: str


UNSTATED = Origin("reconstructed", "the parameter file names no source")


@dataclasses.dataclass(frozen=True)
class Provenance:
    """Origins of all values: a default and, by path, what differs from it.

    Attributes:
        default: Origin of every value that no entry covers.
        entries: Origin by path; a path covers everything below it, and the longest one wins.
    """

    default: Origin
    entries: Mapping[str, Origin] = dataclasses.field(default_factory=dict)

    def of(self, path: str) -> Origin:
        """Returns the origin of the value at a path."""
        covering = [entry for entry in self.entries if covers(entry, path)]
        return self.entries[max(covering, key=len)] if covering else self.default

    def updated(
        self, paths: Mapping[str, Any], status: Status | None, source: str | None
    ) -> "Provenance":
        """Returns a copy in which the given paths have a new status, a new source, or both."""
        if status is None and source is None:
            return self
        entries = dict(self.entries)
        for path in paths:
            old = self.of(path)
            entries[path] = Origin(status or old.status, source or old.source)
        return Provenance(self.default, entries)


def covers(entry: str, path: str) -> bool:
    """Says whether a path equals an entry or lies below it."""
    return path == entry or path.startswith((f"{entry}.", f"{entry}["))


@dataclasses.dataclass(frozen=True)
class Posterior:
    """What an identification knows about the values it estimated.

    Attributes:
        names: Parameter paths, or effect parameters as `effects.servo_lag.time_constant`.
        mean: Estimates in the units of the parameters, shape (n,).
        covariance: Covariance of the estimates, shape (n, n), symmetric, positive semidefinite.
        validity: The data behind the estimates, as plain YAML values: `dataset`, `runs` or
            `conditions`, and `ranges`, the lowest and highest value of each command and channel in
            SI units. Simulators and environments warn far outside of the commands' ranges.
    """

    names: tuple[str, ...]
    mean: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    validity: Mapping[str, Any] = dataclasses.field(default_factory=dict)
