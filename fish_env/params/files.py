"""Reading and writing YAML files without losing or guessing anything."""

import re
from pathlib import Path
from typing import Any

import yaml

from fish_env.errors import ParameterError


class StrictLoader(yaml.SafeLoader):
    """YAML's safe loader, refusing repeated keys and reading 1e-3 as a number, not as text."""


def construct_mapping(loader: StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    """Builds a mapping and refuses a key that stands in it twice."""
    loader.flatten_mapping(node)
    mapping: dict[Any, Any] = {}
    for key_node, value_node in node.value:
        key = loader.construct_object(key_node, deep=True)
        if key in mapping:
            line = key_node.start_mark.line + 1
            raise yaml.YAMLError(f"line {line}: the key '{key}' is there twice; keep one")
        mapping[key] = loader.construct_object(value_node, deep=True)
    return mapping


StrictLoader.add_constructor("tag:yaml.org,2002:map", construct_mapping)
StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$"),
    list("-+0123456789"),
)


def read_yaml(path: Path) -> dict[str, Any]:
    """Reads a YAML file that holds a mapping.

    Raises:
        ParameterError: The file is missing, is not YAML, repeats a key or holds no mapping.
    """
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Loader=StrictLoader)
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: cannot read the file ({error}); check the path") from error
    except (yaml.YAMLError, TypeError) as error:
        raise ParameterError(f"{path}: not valid YAML ({error}); correct that line") from error
    if not isinstance(data, dict):
        raise ParameterError(f"{path}: holds no 'key: value' sections; write it like a preset file")
    return data


def write_yaml(data: dict[str, Any], path: Path) -> None:
    """Writes nested plain data as YAML in its own order, numbers with every digit."""
    text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, allow_unicode=True)
    path.write_text(text, encoding="utf-8")
