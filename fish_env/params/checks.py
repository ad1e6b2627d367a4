"""What makes a set of numbers a possible fish.

Errors, because no body could have the numbers or the equations of motion break down:

* a value that is not a finite number or is outside its declared bounds; masses, inertias, areas
  and lengths are positive, drag and lift coefficients are not negative, damping takes power out;
* a weight block as heavy as the fish; a crank as long as its connecting rod (it could not turn);
* a moment of inertia larger than the sum of the other two of the same part, which no distribution
  of mass has. An identified value is exempt, and files are warned of: a refit absorbs water that
  moves with the hull, and such an effective inertia need not belong to any rigid body;
* an inertia of the whole fish, block at rest, that is not positive definite about the centre of
  mass. The moments about O_b are positive whenever those of the parts are, but the model keeps no
  products of inertia, so a far off-axis balance can leave the mass matrix indefinite.
"""

import difflib
import math
import numbers
import warnings
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.errors import ParameterError
from fish_env.params import trees
from fish_env.params.balance import central_inertia
from fish_env.params.fields import Leaf, leaves, tables
from fish_env.params.fish_data import FishData
from fish_env.params.provenance import STATUSES, Origin, Posterior
from fish_env.reading import printable_lines, short, shown


def check_fish(fish: FishData) -> None:
    """Checks a whole fish.

    Raises:
        ParameterError: Something is impossible; names file, key and remedy.
    """
    if not isinstance(fish.name, str) or not fish.name.isprintable() or not fish.name.strip():
        raise fault(
            fish, "name", f"is {shown(fish.name)}", "give the fish a name, as printable text"
        )
    for leaf in (*leaves(fish), *leaves(fish.prior, "prior")):
        check_number(fish, leaf.path, leaf.value)
        check_bounds(fish, leaf)
    check_masses(fish)
    for error, identified in broken_triangles(fish):
        if not identified:
            raise error
    check_central_inertia(fish)
    check_effects(fish)
    check_provenance(fish)
    if fish.posterior is not None:
        check_posterior(fish, fish.posterior)


def fault(fish: FishData, key: str, problem: str, remedy: str) -> ParameterError:
    """Words an error: file, key, what is wrong, what to do."""
    return ParameterError(f"{fish.source_file or fish.name}: {key} {problem}; {remedy}")


def closest(word: str, choices: Iterable[str]) -> str:
    """Returns ", did you mean 'x'?" for the choice closest to a word, or nothing."""
    match = difflib.get_close_matches(word, list(choices), n=1, cutoff=0.5)
    return f", did you mean '{match[0]}'?" if match else ""


def unknown_path(fish: FishData, path: str) -> str:
    """Words the error for a path that names no number."""
    origin = fish.source_file or fish.name
    for key, table in tables(fish):
        if path == key or path.startswith(f"{key}."):
            return f"{origin}: {path} is replaced by the table {table.source}; change its rows"
    if path in trees.known_paths(type(fish)):
        below = [leaf.path for leaf in leaves(fish) if leaf.path.startswith(path)]
        return f"{origin}: {path} is a group, not a number; name one of {', '.join(below)}"
    hint = closest(path, (leaf.path for leaf in leaves(fish)))
    return f"{origin}: no parameter {short(path)}{hint or '; see values() for all paths'}"


def check_number(fish: FishData, key: str, value: Any) -> None:
    """Checks that a value is one finite number; true and false are not."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        what = f"{shown(value)} ({type(value).__name__})"
        raise fault(fish, key, f"is {what}, not a number", "write a plain number in SI units")
    if not -math.inf < float(value) < math.inf:
        raise fault(fish, key, f"is {value}", "write a finite number")


def check_bounds(fish: FishData, leaf: Leaf) -> None:
    """Checks that a value lies within its declared bounds."""
    spec = leaf.spec
    if not spec.lower <= leaf.value <= spec.upper:
        unit = "" if spec.unit == "-" else f" {spec.unit}"
        allowed = f"{spec.lower:g} to {spec.upper:g}{unit}"
        raise fault(
            fish,
            leaf.path,
            f"({spec.description}) is {leaf.value:g}{unit}, outside {allowed}",
            f"give a value from {allowed}",
        )


def check_masses(fish: FishData) -> None:
    """Checks that the block is a part of the fish and the crank can turn."""
    mass, crank = fish.mass, fish.weight_block.crank
    if mass.weight_block >= mass.total:
        raise fault(
            fish,
            "mass.weight_block",
            f"is {mass.weight_block:g} kg, no less than mass.total, {mass.total:g} kg",
            "the block is a part of the fish, give it a smaller mass",
        )
    if crank.l1 >= crank.l2:
        raise fault(
            fish,
            "weight_block.crank.l1",
            f"is {crank.l1:g} m, no shorter than weight_block.crank.l2, {crank.l2:g} m",
            "the crank turns only with l1 < l2",
        )


def broken_triangles(fish: FishData) -> Iterator[tuple[ParameterError, bool]]:
    """Parts with a moment above the sum of the other two, and whether it was identified."""
    parts = {
        "inertia.rest": fish.inertia.rest,
        "inertia.weight_block": fish.inertia.weight_block,
    }
    for key, moments in parts.items():
        worst = max(range(3), key=lambda axis: moments[axis])
        others = sum(moments) - moments[worst]
        if moments[worst] <= others * (1 + 1e-9):
            continue
        problem = (
            f"is {moments[worst]:g} kg m^2, more than the other two together, {others:g} kg m^2"
        )
        remedy = "no rigid body has such moments, check the three"
        status = {fish.provenance.of(f"{key}[{axis}]").status for axis in range(3)}
        yield fault(fish, f"{key}[{worst}]", problem, remedy), "identified" in status


def warn_of_effective_inertia(fish: FishData) -> None:
    """Says which moments of inertia no rigid body has: for whoever reads or writes a file."""
    for error, _ in broken_triangles(fish):
        warnings.warn(
            f"{error} (accepted, as it is an identified, effective inertia)", stacklevel=3
        )


def check_central_inertia(fish: FishData) -> None:
    """Checks that the fish's inertia about its centre of mass is positive definite."""
    smallest = float(np.linalg.eigvalsh(central_inertia(fish))[0])
    if smallest <= 0:
        raise fault(
            fish,
            "inertia",
            f"is not positive definite about the centre of mass ({smallest:.3g} kg m^2)",
            "lower mass.static_moment_rest, move the block's bracket, or raise inertia.rest",
        )


def check_effects(fish: FishData) -> None:
    """Checks that effects are names with named finite numbers."""
    for name, parameters in fish.effects.items():
        key = f"effects.{short(str(name))}"
        if not isinstance(name, str) or not isinstance(parameters, Mapping):
            remedy = "write each effect as a name with its parameters below"
            raise fault(fish, key, f"is {shown(parameters)}", remedy)
        for parameter, value in parameters.items():
            check_number(fish, f"{key}.{short(str(parameter))}", value)


def check_provenance(fish: FishData) -> None:
    """Checks that origins have a known status and a source, and belong to something."""
    known = trees.known_paths(type(fish))
    check_origin(fish, "default", fish.provenance.default)
    for path, origin in fish.provenance.entries.items():
        check_origin(fish, path, origin)
        if path not in known:
            remedy = f"name a parameter or a group{closest(path, known)}"
            raise fault(fish, f"provenance.{short(path)}", "belongs to nothing", remedy)


def check_origin(fish: FishData, path: str, origin: Origin) -> None:
    """Checks status and source of one origin."""
    if origin.status not in STATUSES:
        remedy = f"use one of {', '.join(STATUSES)}"
        raise fault(fish, f"provenance.{short(path)}.status", f"is {shown(origin.status)}", remedy)
    if not isinstance(origin.source, str) or not printable_lines(origin.source.strip() or "\0"):
        remedy = "say in words where the value comes from"
        raise fault(fish, f"provenance.{short(path)}.source", f"is {shown(origin.source)}", remedy)


def check_posterior(fish: FishData, posterior: Posterior) -> None:
    """Checks names, sizes and definiteness of a posterior."""
    check_names(fish, posterior.names)
    if not isinstance(posterior.validity, Mapping):
        remedy = "write it as keys and values"
        raise fault(fish, "posterior.validity", f"is {shown(posterior.validity)}", remedy)
    count = len(posterior.names)
    rows = [len(row) for row in posterior.covariance]
    if len(posterior.mean) != count or rows != [count] * count:
        lengths = shown(rows)
        problem = f"has {count} names, {len(posterior.mean)} means and covariance rows of {lengths}"
        raise fault(fish, "posterior", problem, "give one mean and one row and column per name")
    for value in (*posterior.mean, *(item for row in posterior.covariance for item in row)):
        check_number(fish, "posterior", value)
    check_covariance(fish, np.array(posterior.covariance))


def check_names(fish: FishData, names: tuple[str, ...]) -> None:
    """Checks that a posterior names parameters or effect parameters of the fish, once each."""
    known = {leaf.path for leaf in leaves(fish)}
    known |= {f"effects.{name}.{key}" for name, values in fish.effects.items() for key in values}
    for name in names:
        if not isinstance(name, str):
            raise fault(fish, f"posterior.names: {shown(name)}", "is no text", "write a path")
        if name not in known:
            remedy = f"name a parameter or an effect parameter of this file{closest(name, known)}"
            raise fault(fish, f"posterior.names: {short(name)}", "is unknown", remedy)
    if len(set(names)) < len(names):
        raise fault(fish, "posterior.names", "has a name twice", "name each parameter once")


def check_covariance(fish: FishData, matrix: FloatArray) -> None:
    """Checks that a covariance is symmetric and positive semidefinite, in units of its diagonal."""
    scale = np.sqrt(np.clip(np.diag(matrix), 0.0, None)) if matrix.size else np.ones(0)
    scale[scale == 0] = 1.0
    correlation = matrix / np.outer(scale, scale)
    symmetric = np.allclose(correlation, correlation.T, atol=1e-9)
    if not symmetric or (matrix.size and np.linalg.eigvalsh(correlation)[0] < -1e-9):
        problem = "is not symmetric and positive semidefinite"
        raise fault(fish, "posterior.covariance", problem, "write the whole estimated covariance")
