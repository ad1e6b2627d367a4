"""Lines of dataset.yaml that put a mistake right, in the names and units of the file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from fish_env.data.schema import Dataset
from fish_env.data.units import SI_UNIT
from fish_env.data.vocabulary import CHANNELS, COMMANDS

_EXCHANGED = {"x": "y", "y": "x"}


class Lines:
    """Words lines for one dataset.

    Args:
        dataset: what its file declares is kept with it.
    """

    def __init__(self, dataset: Dataset) -> None:
        self.declared = dataset.declared
        self.turned = dataset.frame == "enu"

    def signs(self, names: Sequence[str]) -> str:
        """Quantities of the wrong sign."""
        return self._line({name: {"sign": "-1"} for name in names})

    def units(self, names: Sequence[str], unit: str) -> str:
        """Quantities that are in another unit."""
        return self._line({name: {"unit": unit} for name in names})

    def swap(self, one: str, other: str) -> str:
        """Two channels, or two commands, in each other's columns."""
        first, second = (self._declared(name)[0] for name in (one, other))
        return self._line({one: {"column": second}, other: {"column": first}})

    def offset(self, name: str, offset: float) -> str:
        """An angle with another zero.

        Args:
            name: the channel.
            offset: what is to be added to it in the frame of the model, rad.
        """
        value = -offset if self.turned else offset
        if self._declared(name)[1] == "deg":
            value = math.degrees(value)
        return self._line({name: {"offset": f"{value:.5g}"}})

    def own_frame(self, name: str) -> str:
        """A channel that is in the other frame."""
        return self._line({name: {"frame": "ned" if self.turned else "enu"}})

    def _line(self, changes: Mapping[str, Mapping[str, str]]) -> str:
        section = "channels" if next(iter(changes)) in CHANNELS else "commands"
        words = [f"{self._name(name)}: {self._entry(name, keys)}" for name, keys in changes.items()]
        return f"{section}: {{{', '.join(words)}}}"

    def _entry(self, name: str, keys: Mapping[str, str]) -> str:
        column, unit = self._declared(name)
        whole = {"unit": unit, **keys}
        if column != self._name(name) and "column" not in whole:
            whole = {"column": column, **whole}
        if whole.keys() == {"unit"}:
            return whole["unit"]
        return f"{{{', '.join(f'{key}: {value}' for key, value in whole.items())}}}"

    def _name(self, name: str) -> str:
        """Name of a quantity of the model in the file."""
        if self.turned and name in _EXCHANGED:
            return _EXCHANGED[name]
        return "depth" if name == "z" and "depth" in self.declared else name

    def _declared(self, name: str) -> tuple[str, str]:
        """Column and unit of a quantity in the file; as the model has it where none is known."""
        own = self._name(name)
        quantity = {**CHANNELS, **COMMANDS}[name]
        return self.declared.get(own, (own, SI_UNIT[quantity.dimension]))
