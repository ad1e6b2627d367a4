"""Fish files: finding presets, reading, inheriting from a base, writing.

A file may name a `base`, a preset or another file, and then give only what differs: sections are
merged key by key, anything else replaces what the base says. Paths of bases and tables are relative
to the file that names them.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fish_env.errors import ParameterError
from fish_env.files import check_first_line, check_mark, check_no_links
from fish_env.params import trees
from fish_env.params.building import EXTENDED_FORMAT, build_fish
from fish_env.params.checks import closest, warn_of_effective_inertia
from fish_env.params.files import read_yaml, write_yaml
from fish_env.params.provenance import Origin, Posterior, Provenance
from fish_env.params.schema import FishParams
from fish_env.params.tables import HEAD, write_table
from fish_env.reading import Unreadable, located, shown
from fish_env.version import PROGRAM

SUFFIXES = (".yaml", ".yml")
MOST_BASES = 20


def config_root() -> Path:
    """Returns the folder of packaged configurations, in a checkout or an installed wheel.

    Raises:
        ParameterError: There is none; the installation is incomplete.
    """
    package = Path(__file__).resolve().parent.parent
    for folder in (package / "configs", package.parent / "configs"):
        if (folder / "fish").is_dir():
            return folder
    raise ParameterError(f"{package}: no configs folder; reinstall the package")


def list_fish() -> list[str]:
    """Returns the names of the fish that come with the package, sorted."""
    return sorted(path.stem for path in (config_root() / "fish").glob("*.yaml"))


def load_fish(name_or_path: str | Path, trust_effects: bool = False) -> FishParams:
    """Reads a fish: a preset by its name, or any YAML file by its path.

    Args:
        name_or_path: A preset's name, or a file.
        trust_effects: Let the models of this fish run the effect files (Python code) that lie
            beside the file and that it names. Reading alone never runs code.

    Raises:
        ParameterError: There is no such fish, or its file is not a possible one; names file, key
            and remedy.
    """
    file = find_fish(name_or_path, Path())
    fish = build_fish(read_merged(file, ()), file)
    warn_of_effective_inertia(fish)
    return dataclasses.replace(fish, trust_effects=trust_effects)


def as_fish(fish: FishParams | str | Path, trust_effects: bool = False) -> FishParams:
    """Returns the parameters that an argument means: as they are, or read by name or path.

    Args:
        fish: Parameters, a preset's name, or a file.
        trust_effects: As for :func:`load_fish`; what the parameters say already stays.

    Raises:
        ParameterError: There is no such fish, or its file is not a possible one.
    """
    if not isinstance(fish, FishParams):
        return load_fish(fish, trust_effects)
    return dataclasses.replace(fish, trust_effects=True) if trust_effects else fish


def fish_files(fish: FishParams | str | Path) -> list[Path]:
    """Returns the files that a fish is read from: its own, its bases', tables and effect files.

    Args:
        fish: Parameters, a preset's name, or a file.

    Raises:
        ParameterError: There is no such fish, or a file cannot be read.
    """
    file = fish.source_file if isinstance(fish, FishParams) else find_fish(fish, Path())
    found: list[Path] = []
    while file is not None and file not in found:
        found.append(file)
        data = read_yaml(file)
        resolve_tables(data, file)
        found += tables_in(data)
        effects = data.get("effects")
        if isinstance(effects, Mapping):
            found += [file.parent / f"{name}.py" for name in effects]
        base = data.get("base")
        file = find_base(base, file) if isinstance(base, str) else None
    return found


def tables_in(data: Any) -> list[Path]:
    """Returns the tables that nested data name, once `resolve_tables` has made them absolute."""
    if not isinstance(data, dict):
        return []
    own = [Path(data["table"])] if isinstance(data.get("table"), str) else []
    return own + [path for value in data.values() for path in tables_in(value)]


def fish_outputs(fish: FishParams, path: str | Path) -> dict[str, Path]:
    """Returns the files that `save_fish` writes: that of the fish as "", tables by their curve."""
    file = Path(path)
    tables = {key: file.with_name(f"{file.stem}.{key}.csv") for key in fish.tables()}
    return {"": file, **tables}


def find_fish(name_or_path: str | Path, folder: Path) -> Path:
    """Returns the file of a preset name, or of a path relative to a folder."""
    name = str(name_or_path)
    if name in list_fish():
        return config_root() / "fish" / f"{name}.yaml"
    try:
        path = located(name, folder).resolve()
    except Unreadable as error:
        raise ParameterError(f"{error}") from None
    if path.is_file():
        return path
    if path.suffix in SUFFIXES:
        raise ParameterError(f"{path}: no such file; check the path")
    presets = list_fish()
    raise ParameterError(
        f"no fish {shown(name)}{closest(name, presets) or ';'} "
        f"give the path of a YAML file or one of {', '.join(presets)}"
    )


def read_merged(file: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    """Reads a file merged over its bases, its table paths made absolute."""
    if len(above) > MOST_BASES:
        raise ParameterError(
            f"{above[0]}: base: more than {MOST_BASES} files in a chain of bases; merge some"
        )
    if file in above:
        chain = " -> ".join(str(path) for path in (*above, file))
        raise ParameterError(f"{file}: base: the bases form a circle, {chain}; remove one")
    data = read_yaml(file)
    base = data.pop("base", None)
    resolve_tables(data, file)
    if base is None:
        return data
    if not isinstance(base, str):
        raise ParameterError(f"{file}: base is {shown(base)}; give the name or the path of a fish")
    if "name" not in data:
        raise ParameterError(f"{file}: missing key name; a fish that differs needs its own")
    return merged(read_merged(find_base(base, file), (*above, file)), data)


def find_base(base: str, file: Path) -> Path:
    """Returns the file of a base, saying in any error which file asked for it."""
    try:
        return find_fish(base, file.parent)
    except ParameterError as error:
        raise ParameterError(f"{file}: base: {error}") from error


def resolve_tables(data: Any, file: Path) -> None:
    """Makes the table paths in nested data of a file absolute, in place."""
    if not isinstance(data, dict):
        return
    if isinstance(data.get("table"), str):
        try:
            data["table"] = str(located(data["table"], file.parent).resolve())
        except Unreadable as error:
            raise ParameterError(f"{file}: table: {error}") from None
    for value in data.values():
        resolve_tables(value, file)


def merged(base: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a base with a change merged in, section by section.

    A curve changes between analytic and table as a whole, so there the change replaces the base.
    """
    result = dict(base)
    for key, value in change.items():
        result[key] = merged_value(result.get(key), value)
    return result


def merged_value(old: Any, new: Any) -> Any:
    """Returns what one key holds after a merge."""
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return new
    return merged(old, new) if ("table" in old) == ("table" in new) else new


def check_tables(fish: FishParams, path: str | Path) -> None:
    """Refuses a file for `save_fish` whose tables would replace what this program did not write.

    Args:
        fish: The parameters.
        path: The file; the program chose the names of the tables beside it.

    Raises:
        OutputError: Names a table that is a link, or is not one of a fish of this program there.
    """
    file, *tables = fish_outputs(fish, path).values()
    check_tables_of(file, tables)


def check_tables_of(file: Path, tables: Iterable[Path]) -> None:
    """Refuses tables for a fish's file as :func:`check_tables` does.

    Args:
        file: The file, which names the program if it is of it.
        tables: Its tables, which need not be there.

    Raises:
        OutputError: Names a table.
    """
    for table in tables:
        check_no_links([table])
        check_first_line(table, HEAD)
        check_mark(table, PROGRAM, beside=file)


def save_fish(fish: FishParams, path: str | Path) -> list[Path]:
    """Writes a fish to a file that loads equal to it, without reference to a base.

    Coefficient tables are copied beside it as `<stem>.<curve>.csv` and move along with it.

    Args:
        fish: The parameters.
        path: The file to write, ending in .yaml or .yml.

    Returns:
        The files written: that of the fish, and its tables.

    Raises:
        ParameterError: The path has another ending.
        OutputError: A file cannot be written.
    """
    file = Path(path)
    if file.suffix not in SUFFIXES:
        raise ParameterError(f"{file}: give the file the ending .yaml")
    warn_of_effective_inertia(fish)
    data: dict[str, Any] = {"name": fish.name, **trees.to_plain(fish)}
    if fish.posterior is not None:
        data = {"format": EXTENDED_FORMAT, **data}
    written = fish_outputs(fish, file)
    save_tables(fish, data, written)
    data["prior"] = trees.to_plain(fish.prior)
    data["provenance"] = plain_provenance(fish.provenance)
    if fish.effects:
        data["effects"] = {name: dict(values) for name, values in fish.effects.items()}
    if fish.posterior is not None:
        data["posterior"] = plain_posterior(fish.posterior)
    write_yaml(data, file)
    return list(written.values())


def save_tables(fish: FishParams, data: dict[str, Any], copies: Mapping[str, Path]) -> None:
    """Writes the tables to their copies and puts the names of these into the fish's data."""
    for key, table in fish.tables().items():
        copy = copies[key]
        write_table(table, copy)
        *parents, last = key.split(".")
        section = data
        for parent in parents:
            section = section[parent]
        section[last] = {"table": copy.name}


def plain_provenance(provenance: Provenance) -> dict[str, Any]:
    """Returns origins as nested plain data."""
    entries = {"default": provenance.default, **provenance.entries}
    return {path: plain_origin(origin) for path, origin in entries.items()}


def plain_origin(origin: Origin) -> dict[str, str]:
    """Returns one origin as plain data."""
    return {"status": origin.status, "source": origin.source}


def plain_posterior(posterior: Posterior) -> dict[str, Any]:
    """Returns a posterior as nested plain data."""
    return {
        "names": list(posterior.names),
        "mean": list(posterior.mean),
        "covariance": [list(row) for row in posterior.covariance],
        "validity": dict(posterior.validity),
    }
