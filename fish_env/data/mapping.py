"""Access to the sections of dataset.yaml: every key is known, required or refused by name."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from fish_env.data.place import Place, closest
from fish_env.data.table import read_text
from fish_env.reading import (
    Unreadable,
    located,
    plain_number,
    printable_lines,
    short,
    shown,
)
from fish_env.yaml_text import TextLoader, parse_yaml


class Section:
    """One mapping of dataset.yaml, its values all text, lists or sections.

    Attributes:
        place: The file, the run where it is about one, and the path of the section.
    """

    def __init__(self, content: object, place: Place) -> None:
        if not isinstance(content, dict):
            raise place.refuse("this must hold 'key: value' pairs", "Write it as the format shows")
        self._content = content
        self.place = place

    @property
    def content(self) -> dict[str, Any]:
        """A copy of all that stands in it."""
        return dict(self._content)

    def __contains__(self, key: str) -> bool:
        return key in self._content

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def at(self, key: str) -> Place:
        """Returns the place of a key."""
        above = self.place.key
        return replace(self.place, key=f"{above}.{key}" if above else key)

    def allow(self, known: Iterable[str], what: str = "key") -> None:
        """Refuses every key but these.

        Raises:
            DatasetError: Naming the first unknown key and the one most like it.
        """
        names = list(known)
        for key in self._content:
            if key not in names:
                raise self.at(key).refuse(
                    f"unknown {what} '{short(key)}'", closest(short(key), names)
                )

    def require(self, keys: Iterable[str]) -> None:
        """Refuses the section unless it has all these keys.

        Raises:
            DatasetError: Naming the first missing key.
        """
        for key in keys:
            if key not in self:
                raise self.at(key).refuse(f"the key '{key}' is missing", "Add it")

    def text(self, key: str) -> str:
        """Returns a value that must be text.

        Raises:
            DatasetError: The key is missing, empty, or holds a list or a section.
        """
        self.require([key])
        value = self._content[key]
        if not isinstance(value, str) or not value.strip():
            raise self.at(key).refuse("this must be a text", "Write one after the colon")
        if not printable_lines(value):
            raise self.at(key).refuse(f"{shown(value)} has a control character", "Write it without")
        return value.strip()

    def choice(self, key: str, choices: Iterable[str]) -> str:
        """Returns a value that must be one of a few words.

        Raises:
            DatasetError: It is missing, or another word.
        """
        value = self.text(key)
        if value not in choices:
            known = ", ".join(choices)
            raise self.at(key).refuse(f"'{short(value)}' is not known here", f"Use one of: {known}")
        return value

    def number(self, key: str) -> float:
        """Returns a value that must be a finite number.

        Raises:
            DatasetError: It is not.
        """
        text = self.text(key)
        value = plain_number(text)
        if not abs(value) < float("inf"):
            raise self.at(key).refuse(
                f"{shown(text)} is not a finite number", "Write a plain number"
            )
        return value

    def path(self, key: str) -> Path:
        """Returns a path, relative to the folder of the file; it need not exist.

        Raises:
            DatasetError: The text is missing, or no path can be so named.
        """
        try:
            return located(self.text(key), self.place.file.parent)
        except Unreadable as error:
            raise self.at(key).unreadable(error) from None

    def holds_section(self, key: str) -> bool:
        """Whether the value of a key is a section of its own."""
        return isinstance(self._content.get(key), dict)

    def section(self, key: str) -> "Section":
        """Returns the section under a key; one that is absent is empty.

        Raises:
            DatasetError: The key holds something else.
        """
        return Section(self._content.get(key, {}), self.at(key))

    def items(self, key: str) -> list[object]:
        """Returns the list under a key.

        Raises:
            DatasetError: It is missing, empty, or no list.
        """
        self.require([key])
        value = self._content[key]
        if not isinstance(value, list) or not value:
            raise self.at(key).refuse("this must be a list with entries", "Write one '- ' each")
        return value


def read_section(place: Place) -> Section:
    """Reads a YAML file that holds one mapping.

    Raises:
        DatasetError: The file is missing, empty or no YAML, or a key stands in it twice.
    """
    return parse_section(read_text(place), place)


def parse_section(text: str, place: Place) -> Section:
    """Reads YAML text that holds one mapping.

    Args:
        text: The YAML.
        place: Where it stands, for errors.

    Raises:
        DatasetError: The text is empty or no YAML, or a key stands in it twice.
    """
    try:
        content = parse_yaml(text, TextLoader)
    except Unreadable as error:
        raise place.refuse(f"this is {error.reason}", "Correct it") from error
    if content is None:
        raise place.refuse("the file is empty", "Describe the dataset in it")
    return Section(content, place)
