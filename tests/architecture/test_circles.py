"""No module imports itself by way of others, not even for its types or inside a function."""

from pathlib import Path

import pytest

from scripts.import_graph import circles, circles_in_words, graph_of, imports_of, layers, reduced

TYPED = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import {name}\n"
INSIDE = "def f():\n    import {name}\n"


def test_no_module_imports_itself_by_way_of_others():
    assert circles_in_words(imports_of("robofish_agents", "fish_env")) == []


@pytest.mark.parametrize(
    ("package", "first", "kind"),
    [("wheel_a", "import {name}\n", "top"), ("wheel_b", TYPED, "typing"),
     ("wheel_c", INSIDE, "function")],
)  # fmt: skip
def test_the_check_notices_each_kind_of_circle(tmp_path, monkeypatch, package, first, kind):
    monkeypatch.syspath_prepend(tmp_path)
    write(tmp_path / package, a=first.format(name=f"{package}.b"), b=f"import {package}.c",
          c=f"from {package} import a", d=f"import {package}.a")  # fmt: skip
    (told,) = circles_in_words(imports_of(package))
    assert f"{package}.a -> {package}.b ({kind})" in told
    assert f"{package}.c -> {package}.a (top)" in told
    assert f"{package}.d" not in told


def test_a_chain_is_no_circle(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    write(tmp_path / "chain", a="import chain.b, chain.c", b="import chain.c", c="")
    imports = imports_of("chain")
    assert circles_in_words(imports) == []
    graph = graph_of(imports)
    assert graph["chain.a"] == {"chain.b", "chain.c"}
    assert reduced(graph)["chain.a"] == {"chain.b"}
    assert layers(graph) == (("chain.c",), ("chain.b",), ("chain.a",))


def test_two_circles_are_told_apart():
    graph = {"a": {"b"}, "b": {"a"}, "c": {"a", "d"}, "d": {"e"}, "e": {"c"}, "f": {"a"}}
    assert circles({name: frozenset(others) for name, others in graph.items()}) == (
        ("a", "b"),
        ("c", "d", "e"),
    )


def write(folder: Path, **modules: str) -> None:
    """Write a package of some modules."""
    folder.mkdir()
    (folder / "__init__.py").touch()
    for name, source in modules.items():
        (folder / f"{name}.py").write_text(f"{source}\n")
