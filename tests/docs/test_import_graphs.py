"""The pictures of the imports are drawn from the imports, and each arrow of them leads down."""

import re

import pytest

from scripts.import_graph import circles, graph_of, imports_of
from scripts.layered_drawing import drawing
from scripts.make_import_graphs import ASSETS, module_of_inference, part_of, pictures


@pytest.fixture(scope="module")
def made():
    return pictures()


@pytest.mark.parametrize("name", ["imports.svg", "imports-inference.svg"])
def test_the_picture_is_made_from_the_imports(made, name):
    drawn = (ASSETS / name).read_text(encoding="utf-8")
    assert drawn == made[name], "run python -m scripts.make_import_graphs"


@pytest.mark.parametrize("node", [part_of, module_of_inference])
def test_every_module_has_a_box(made, node):
    graph = graph_of(imports_of("robofish_agents", "fish_env"), node)
    assert circles(graph) == ()
    boxes = set().union(*(re.findall(r">([\w.]+)</text>", text) for text in made.values()))
    assert set(graph) <= boxes


def test_another_import_makes_another_picture():
    graph = {"a": frozenset("b"), "b": frozenset("c"), "c": frozenset(), "d": frozenset("c")}
    before = drawing(graph, "")
    assert drawing({**graph, "d": frozenset("b")}, "") != before
    assert drawing({**graph, "a": frozenset("bc")}, "") == before, "a to c follows from a to b"


def test_lines_lead_down_past_the_layers_between():
    names = "abcd"
    chain = {n: frozenset(names[i + 1 : i + 2]) for i, n in enumerate(names)}
    long_way = {**chain, "e": frozenset("d"), "f": frozenset("ae")}
    for path in re.findall(r'<path d="([^"]+)"', drawing(long_way, "")):
        heights = [int(y) for y in re.findall(r"(\d+)(?=C|V|$)", path)]
        assert heights == sorted(heights)
        assert len(set(heights)) == len(heights)
