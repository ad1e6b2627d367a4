"""Reading and writing YAML files without losing or guessing anything."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fish_env.errors import ParameterError
from fish_env.files import write_text


class StrictLoader(yaml.SafeLoader):
    """YAML's safe loader, refusing repeated keys and reading 1e-3 as a number, not as text."""


def construct_mapping(loader: StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    """Builds a mapping and refuses a key that stands in it twice."""
    seen: set[str] = set()
    for key_node, _ in node.value:
        if key_node.value in seen:
            where = f"line {key_node.start_mark.line + 1}"
            raise yaml.YAMLError(f"{where}: the key '{key_node.value}' is there twice; keep one")
        seen.add(key_node.value)
    return loader.construct_mapping(node, deep=True)


StrictLoader.add_constructor("tag:yaml.org,2002:map", construct_mapping)
StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$"),
    list("-+0123456789"),
)


class PlainDumper(yaml.SafeDumper):
    """YAML's safe dumper, which also takes numpy numbers and arrays."""


def represent_numpy(dumper: PlainDumper, value: Any) -> yaml.Node:
    """Writes a numpy number or array as the plain number or list it holds."""
    return dumper.represent_data(value.tolist())


for numpy_type in (np.bool_, np.integer, np.floating, np.ndarray):
    PlainDumper.add_multi_representer(numpy_type, represent_numpy)


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
    text = yaml.dump(
        data, Dumper=PlainDumper, sort_keys=False, default_flow_style=None, allow_unicode=True
    )
    write_text(path, text)
