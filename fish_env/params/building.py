"""From a YAML file's nested data to a fish: keys first, every missing or unknown one named."""

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fish_env.errors import ParameterError
from fish_env.params.checks import closest
from fish_env.params.fields import as_number, join, parameter_fields
from fish_env.params.groups import Prior
from fish_env.params.provenance import UNSTATED, Origin, Posterior, Provenance
from fish_env.params.schema import FishParams
from fish_env.params.tables import CoefficientTable, TableKind, read_table
from fish_env.reading import short, shown

AXES = 3
OPTIONAL = ("format", "effects", "provenance", "posterior")
EXTENDED_FORMAT = "robofish-extended/1"
"""Form of a file that an identification wrote; one without a format is read as this."""


def build_fish(data: Mapping[str, Any], file: Path) -> FishParams:
    """Builds a fish from the data of its file, bases already merged in.

    Table paths must be absolute; `resolve_tables` makes them so.

    Raises:
        ParameterError: A key is unknown or missing, or a value is impossible.
    """
    groups = [field.name for field in parameter_fields(FishParams)]
    check_keys(data, ["name", *groups, "prior"], OPTIONAL, "", file)
    if data.get("format", EXTENDED_FORMAT) != EXTENDED_FORMAT:
        raise ParameterError(
            f"{file}: format is {shown(data['format'])}, this version reads {EXTENDED_FORMAT}; "
            "update robotic-fish, or write the file again with this version"
        )
    fields = {
        field.name: build_field(field, data, "", file) for field in parameter_fields(FishParams)
    }
    return FishParams(
        name=data["name"],
        **fields,
        prior=build_group(Prior, data["prior"], "prior", file),
        effects=build_effects(data.get("effects"), file),
        provenance=build_provenance(data.get("provenance"), file),
        posterior=build_posterior(data.get("posterior"), file),
        source_file=file,
    )


def check_keys(
    data: Any, required: Iterable[str], optional: Iterable[str], path: str, file: Path
) -> None:
    """Checks that data are a mapping with all required keys and no unknown ones."""
    required, known = list(required), [*required, *optional]
    if not isinstance(data, Mapping):
        keys = ", ".join(known)
        raise ParameterError(
            f"{file}: {path or 'the file'} is {shown(data)}; write a section with the keys {keys}"
        )
    for key in data:
        if key not in known:
            hint = closest(short(str(key)), known) or f"; known keys are {', '.join(known)}"
            raise ParameterError(f"{file}: unknown key {join(path, short(str(key)))}{hint}")
    for key in required:
        if key not in data:
            raise ParameterError(f"{file}: missing key {join(path, key)}; add it or name a base")


def build_group(cls: type[Any], data: Any, path: str, file: Path) -> Any:
    """Builds one parameter group from its section."""
    fields = list(parameter_fields(cls))
    check_keys(data, [field.name for field in fields], (), path, file)
    return cls(**{field.name: build_field(field, data, path, file) for field in fields})


def build_field(
    field: dataclasses.Field[Any], data: Mapping[str, Any], path: str, file: Path
) -> Any:
    """Builds one field of a group: a table, a section, a vector or a number."""
    value, here, metadata = data[field.name], join(path, field.name), field.metadata
    if metadata.get("table") and isinstance(value, Mapping) and "table" in value:
        return build_table(value, metadata["table"], here, file)
    if "section" in metadata:
        return build_group(metadata["section"], value, here, file)
    if "axes" in metadata:
        return build_vector(value, here, file)
    return as_number(value)


def build_vector(value: Any, path: str, file: Path) -> tuple[Any, ...]:
    """Builds a vector of three numbers."""
    if not isinstance(value, list) or len(value) != AXES:
        raise ParameterError(f"{file}: {path} is {shown(value)}; write three numbers, [x, y, z]")
    return tuple(as_number(item) for item in value)


def build_table(
    value: Mapping[str, Any], kind: TableKind, path: str, file: Path
) -> CoefficientTable:
    """Reads the table that replaces a curve."""
    check_keys(value, ["table"], (), path, file)
    if not isinstance(value["table"], str):
        raise ParameterError(
            f"{file}: {path}.table is {shown(value['table'])}; give a CSV file's path"
        )
    try:
        return read_table(Path(value["table"]), kind)
    except ParameterError as error:
        raise ParameterError(f"{file}: {path}.table: {error}") from error


def build_effects(data: Any, file: Path) -> dict[str, Any]:
    """Copies the effects section; names and values are checked with the fish."""
    if data is None:
        return {}
    if not isinstance(data, Mapping):
        raise ParameterError(
            f"{file}: effects is {shown(data)}; write effect names with their parameters"
        )
    return {name: build_effect(parameters) for name, parameters in data.items()}


def build_effect(parameters: Any) -> Any:
    """Copies one effect's parameters; leaves anything else for the checks to judge."""
    if not isinstance(parameters, Mapping):
        return parameters
    return {key: as_number(value) for key, value in parameters.items()}


def build_provenance(data: Any, file: Path) -> Provenance:
    """Builds the origins; a file that says nothing of them gets `UNSTATED`."""
    if data is None:
        return Provenance(UNSTATED)
    if not isinstance(data, Mapping) or "default" not in data:
        raise ParameterError(f"{file}: missing key provenance.default; add its status and source")
    entries = {
        str(path): build_origin(value, f"provenance.{path}", file) for path, value in data.items()
    }
    return Provenance(entries.pop("default"), entries)


def build_origin(data: Any, path: str, file: Path) -> Origin:
    """Builds status and source of one provenance entry."""
    check_keys(data, ["status", "source"], (), path, file)
    return Origin(data["status"], data["source"])


def build_posterior(data: Any, file: Path) -> Posterior | None:
    """Builds the posterior an extended model carries."""
    if data is None:
        return None
    check_keys(data, ["names", "mean", "covariance", "validity"], (), "posterior", file)
    names, mean, covariance = (data[key] for key in ("names", "mean", "covariance"))
    whole = all(isinstance(item, list) for item in (names, mean, covariance))
    if not whole or not all(isinstance(row, list) for row in covariance):
        raise ParameterError(f"{file}: posterior: write names, mean and covariance rows as lists")
    rows = tuple(tuple(as_number(item) for item in row) for row in covariance)
    return Posterior(tuple(names), tuple(map(as_number, mean)), rows, data["validity"] or {})
