"""Which module of this project imports which, and the circles among them.

An import counts wherever it stands: at the top of a module, below ``if TYPE_CHECKING``, or inside a
function. The last two hide a circle from Python, not from a reader.
"""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import grimp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

Kind = Literal["top", "typing", "function"]
Graph = Mapping[str, frozenset[str]]
"""Node -> the nodes that it imports."""


@dataclass(frozen=True)
class Import:
    """One module that imports another.

    Attributes:
        importer: dotted name of the module that imports.
        imported: dotted name of the other.
        kind: where it is imported: at the top of the module, only below ``if TYPE_CHECKING``, or
            only inside functions.
    """

    importer: str
    imported: str
    kind: Kind


def imports_of(*packages: str) -> tuple[Import, ...]:
    """Every import among the modules of some packages, which must be importable.

    Args:
        packages: names of top-level packages.
    """
    graph = grimp.build_graph(*packages, cache_dir=None)
    untyped = grimp.build_graph(*packages, cache_dir=None, exclude_type_checking_imports=True)
    found = []
    for importer in sorted(graph.modules):
        for imported in sorted(graph.find_modules_directly_imported_by(importer)):
            details = graph.get_import_details(importer=importer, imported=imported)
            lines = [detail["line_number"] for detail in details]
            kind: Kind = "top"
            if not untyped.direct_import_exists(importer=importer, imported=imported):
                kind = "typing"
            elif all(line in _lines_in_functions(importer) for line in lines):
                kind = "function"
            found.append(Import(importer, imported, kind))
    return tuple(found)


@cache
def _lines_in_functions(module: str) -> frozenset[int]:
    """Numbers of the lines of a module that stand inside a function."""
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    tree = ast.parse(Path(spec.origin).read_bytes())
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    functions = [node for node in ast.walk(tree) if isinstance(node, kinds)]
    return frozenset(
        line for node in functions for line in range(node.lineno, (node.end_lineno or 0) + 1)
    )


def graph_of(imports: Iterable[Import], node: Callable[[str], str] = str) -> Graph:
    """The graph of some imports.

    Args:
        imports: the imports.
        node: from the name of a module to that of its node; "" leaves the module out.
    """
    edges: dict[str, set[str]] = {}
    for found in imports:
        importer, imported = node(found.importer), node(found.imported)
        for name in filter(None, (importer, imported)):
            edges.setdefault(name, set())
        if importer and imported and importer != imported:
            edges[importer].add(imported)
    return {name: frozenset(edges[name]) for name in sorted(edges)}


def circles(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Groups of nodes each of which imports itself by way of the others."""
    names = list(graph)
    row = {name: i for i, name in enumerate(names)}
    pairs = [(row[name], row[other]) for name, others in graph.items() for other in others]
    if not pairs:
        return ()
    begins, ends = np.array(pairs).T
    matrix = csr_array((np.ones(len(pairs)), (begins, ends)), shape=(len(names), len(names)))
    count, label = connected_components(matrix, connection="strong")
    groups = [[names[i] for i in np.flatnonzero(label == group)] for group in range(count)]
    return tuple(sorted(tuple(group) for group in groups if len(group) > 1))


def circles_in_words(imports: Iterable[Import]) -> list[str]:
    """One text for each circle: the imports that it is made of, and where each stands."""
    imports = tuple(imports)
    found = []
    for group in circles(graph_of(imports)):
        inside = [i for i in imports if i.importer in group and i.imported in group]
        found.append("; ".join(f"{i.importer} -> {i.imported} ({i.kind})" for i in inside))
    return found


def reduced(graph: Graph) -> Graph:
    """The graph without what follows: an import that a longer way leads to as well is left out.

    Args:
        graph: a graph without circles.
    """

    @cache
    def below(name: str) -> frozenset[str]:
        return graph[name].union(*(below(other) for other in graph[name]))

    return {
        name: frozenset(o for o in others if not any(o in below(b) for b in others - {o}))
        for name, others in graph.items()
    }


def layers(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Nodes by height: each layer imports from those below it only; the lowest imports nothing.

    Args:
        graph: a graph without circles.
    """

    @cache
    def height(name: str) -> int:
        return 1 + max((height(other) for other in graph[name]), default=-1)

    rows = [[n for n in graph if height(n) == h] for h in range(1 + max(map(height, graph)))]
    return tuple(map(tuple, rows))
