"""Reading YAML that others wrote: bounded in depth and size, without the guesses of YAML 1.1."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import Resolver
from yaml.scanner import Scanner

from fish_env.reading import (
    DEEPEST,
    LONGEST_REASON,
    Unreadable,
    printable,
    read_text,
    short,
    words_of,
)

MOST_VALUES = 60_000
"""Values in a file, those behind an alias counted as often as they stand in it."""
_LARGEST_INT = 2**63
_BAD_VALUE = (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError)
"""What PyYAML raises for a tagged value that is not of its tag, such as `!!int x`."""


class _PlainParser(Reader, Scanner, Parser):
    """PyYAML's own parser, four times as slow as libyaml's."""

    def __init__(self, stream: str) -> None:
        Reader.__init__(self, stream)
        Scanner.__init__(self)
        Parser.__init__(self)


_Parser: Any = getattr(getattr(yaml, "cyaml", None), "CParser", _PlainParser)


class Loader(Composer, _Parser, SafeConstructor, Resolver):  # type: ignore[misc]
    """YAML's safe loader, bounded in depth and size, without the guesses of YAML 1.1.

    `yaml.CSafeLoader` composes in C too, where nothing can be counted on the way.

    A repeated key is refused. `1e-3` is a number. `12:30`, which YAML 1.1 takes for 750, and
    `1_0` are text, so that whoever wants a number refuses them.
    """

    def __init__(self, stream: str) -> None:
        _Parser.__init__(self, stream)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)
        self._depth = 0
        self._counts = [0]
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Composes a node and counts what it holds, aliases in full."""
        event: Any = self.peek_event()
        if self._depth > DEEPEST:
            self._refuse(event, f"nested more than {DEEPEST} levels deep")
        alias = isinstance(event, yaml.AliasEvent)
        self._depth += 1
        self._counts.append(1)
        node = super().compose_node(parent, index)
        size = self._counts.pop()
        self._depth -= 1
        if alias:
            if id(node) not in self._sizes:
                self._refuse(event, f"the alias '{event.anchor}' contains itself")
            size = self._sizes[id(node)]
        else:
            self._sizes[id(node)] = size
        self._counts[-1] += size
        if self._counts[-1] > MOST_VALUES:
            self._refuse(event, f"more than {MOST_VALUES:,} values, with aliases written out")
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Builds a mapping and refuses a key that stands in it twice."""
        seen = set[str]()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                self._refuse(key_node, "a key must be a word or a number")
            if key_node.value in seen:
                self._refuse(key_node, f"the key '{short(key_node.value)}' occurs twice")
            seen.add(key_node.value)
        return super().construct_mapping(node, deep=True)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        """Builds a whole number of at most 19 digits."""
        digits = len(node.value)
        value = super().construct_yaml_int(node) if digits < 70 else _LARGEST_INT
        if abs(value) >= _LARGEST_INT:
            self._refuse(node, f"a whole number of {digits} digits")
        return value

    @staticmethod
    def _refuse(at: Any, problem: str) -> None:
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=at.start_mark)


def _construct_map(loader: Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    return loader.construct_mapping(node, deep=True)


Loader.add_constructor("tag:yaml.org,2002:map", _construct_map)
Loader.add_constructor("tag:yaml.org,2002:int", Loader.construct_yaml_int)
_NUMBERS = {
    "int": re.compile(
        r"^[-+]?(0|[1-9][0-9]*|[1-9][0-9]{0,2}(_[0-9]{3})+|0o[0-7]+|0x[0-9a-fA-F]+)$"
    ),
    "float": re.compile(
        r"^[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?$"
        r"|^[-+]?\.(inf|Inf|INF)$|^\.(nan|NaN|NAN)$"
    ),
}
_KINDS = {f"tag:yaml.org,2002:{name}" for name in (*_NUMBERS, "timestamp")}
Loader.yaml_implicit_resolvers = {
    first: [pair for pair in pairs if pair[0] not in _KINDS]
    for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _name, _pattern in _NUMBERS.items():
    Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_name}", _pattern, list("-+0123456789."))


class TextLoader(Loader):
    """The same, with every scalar left as its text: an id `007` stays what it is."""


TextLoader.yaml_implicit_resolvers = {}
TextLoader.yaml_constructors = {
    f"tag:yaml.org,2002:{kind}": constructor
    for kind, constructor in (
        ("map", _construct_map),
        ("seq", lambda loader, node: loader.construct_sequence(node, deep=True)),
        ("str", lambda loader, node: loader.construct_scalar(node)),
    )
}


def parse_yaml(text: str, loader: type[Loader] = Loader) -> Any:
    """Reads YAML text.

    Args:
        text: The YAML.
        loader: `Loader`, or `TextLoader` for values as text.

    Raises:
        Unreadable: It is no YAML, nests too deep, grows too large by its aliases, repeats a key
            or holds a value that is not of its tag; names the line.
    """
    try:
        return yaml.load(text, Loader=loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f"line {mark.line + 1}: " if mark is not None else ""
        problem = printable(error.problem or error.context or "wrong")
        raise Unreadable(
            f"not valid YAML, {line}{short(problem, LONGEST_REASON)}", "correct that line"
        ) from None
    except (yaml.YAMLError, RecursionError, *_BAD_VALUE) as error:
        reason = words_of(error)
        raise Unreadable(f"not valid YAML ({reason})", "correct it") from None


def read_yaml(path: Path, loader: type[Loader] = Loader) -> Any:
    """Reads a YAML file.

    Args:
        path: The file.
        loader: As for :func:`parse_yaml`.

    Raises:
        FileNotFoundError: It is missing.
        Unreadable: It cannot be read, or see :func:`parse_yaml`.
    """
    return parse_yaml(read_text(path), loader)
