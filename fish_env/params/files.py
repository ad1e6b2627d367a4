"""Reading and writing YAML files without losing or guessing anything."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fish_env.errors import ParameterError
from fish_env.files import write_text
from fish_env.reading import Unreadable
from fish_env.version import stamped
from fish_env.yaml_text import read_yaml as read_any_yaml


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
        data = read_any_yaml(path)
    except FileNotFoundError:
        raise ParameterError(f"{path}: no such file; check the path") from None
    except Unreadable as error:
        raise ParameterError(f"{path}: {error}") from error
    if not isinstance(data, dict):
        raise ParameterError(f"{path}: holds no 'key: value' sections; write it like a preset file")
    return data


def write_yaml(data: dict[str, Any], path: Path) -> None:
    """Writes nested plain data as YAML in its own order, numbers with every digit."""
    text = yaml.dump(
        data, Dumper=PlainDumper, sort_keys=False, default_flow_style=None, allow_unicode=True
    )
    write_text(path, stamped(text))
