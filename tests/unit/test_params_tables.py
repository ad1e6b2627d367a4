"""A user's own coefficient tables."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fish_env.errors import ParameterError
from fish_env.params import CoefficientTable, load_fish, save_fish

HALF_PI = 0.5 * math.pi
CURVES = {
    "tail.drag": "tail: {drag: {table: my.csv}}",
    "tail.lift": "tail: {lift: {table: my.csv}}",
    "body.plane_xz.drag": "body: {plane_xz: {drag: {table: my.csv}}}",
    "body.plane_xz.lift": "body: {plane_xz: {lift: {table: my.csv}}}",
    "body.plane_xz.impact_moment": "body: {plane_xz: {impact_moment: {table: my.csv}}}",
    "body.plane_xy.drag": "body: {plane_xy: {drag: {table: my.csv}}}",
    "body.plane_xy.lift": "body: {plane_xy: {lift: {table: my.csv}}}",
    "body.plane_xy.impact_moment": "body: {plane_xy: {impact_moment: {table: my.csv}}}",
}
SHORT = "alpha_deg,C\n0,0\n15,0.3\n30,0.5\n"


def fish_file(folder: Path, change: str, table: str) -> Path:
    (folder / "my.csv").write_text(table)
    file = folder / "mine.yaml"
    file.write_text(f"name: mine\nbase: zheng-2021-a\n{change}\n")
    return file


def curve(table: CoefficientTable, alpha: np.ndarray) -> np.ndarray:
    """Evaluates a table's cubic pieces the way a kernel would."""
    knots, pieces = table.pchip()
    index = np.clip(np.searchsorted(knots, alpha, side="right") - 1, 0, len(pieces) - 1)
    step, c = alpha - knots[index], pieces[index].T
    return ((c[0] * step + c[1]) * step + c[2]) * step + c[3]


@pytest.mark.parametrize("key", CURVES)
def test_each_curve_can_be_a_table(tmp_path, key):
    fish = load_fish(fish_file(tmp_path, CURVES[key], SHORT))
    assert list(fish.tables()) == [key]
    assert fish.tables()[key].kind == key.rsplit(".", 1)[1]
    assert fish.tables()[key].alpha == pytest.approx([0, math.pi / 12, math.pi / 6])
    assert not any(path.startswith(key) for path in fish.values())
    replaced = set(load_fish("zheng-2021-a").values()) - set(fish.values())
    assert replaced
    with pytest.raises(ParameterError, match=r"replaced by the table.*my\.csv"):
        fish.get(min(replaced))


def test_tables_survive_saving_to_another_folder_and_replacing_values(tmp_path):
    fish = load_fish(fish_file(tmp_path, CURVES["tail.drag"], SHORT)).replace({"mass.total": 2.1})
    target = tmp_path / "other"
    target.mkdir()
    save_fish(fish, target / "copy.yaml")
    (tmp_path / "my.csv").unlink()
    assert load_fish(target / "copy.yaml") == fish
    assert (target / "copy.tail.drag.csv").is_file()


def test_a_table_can_be_given_back_to_the_analytic_form(tmp_path):
    fish_file(tmp_path, CURVES["tail.drag"], SHORT)
    back = tmp_path / "back.yaml"
    back.write_text("name: back\nbase: mine.yaml\ntail: {drag: {c0: 0.1, c2: 2.0}}\n")
    assert load_fish(back).get("tail.drag.c0") == 0.1
    assert load_fish(back).tables() == {}


def test_a_table_s_origin_can_be_stated(tmp_path):
    change = CURVES["tail.drag"] + "\nprovenance: {tail.drag: {status: published, source: CFD}}"
    fish = load_fish(fish_file(tmp_path, change, SHORT))
    assert fish.provenance.of("tail.drag").source == "CFD"


def shape(kind: str, alpha: np.ndarray) -> np.ndarray:
    """The part of each analytic curve that depends on the angle."""
    return np.sin(alpha) ** 2 if kind == "drag" else np.sin(alpha) * np.cos(alpha)


@pytest.mark.parametrize(
    ("kind", "rows"),
    [("drag", (0.1, 0.3, 0.6)), ("lift", (0.0, 0.3, 0.6)), ("impact_moment", (0.0, -0.1, -0.2))],
)
@pytest.mark.parametrize("end", [0.3, math.pi / 6, 1.2, 1.569])
def test_a_short_table_is_extended_by_the_analytic_shape_with_a_warning(kind, rows, end):
    table = CoefficientTable((0.0, end / 2, end), rows, "my.csv", kind)
    with pytest.warns(UserWarning, match=rf"my\.csv.*{end:.4f} rad"):
        knots, pieces = table.pchip()
    assert knots[0] == 0.0
    assert knots[-1] == HALF_PI
    assert np.all(np.diff(knots) > 0)

    def extension(alpha):
        return rows[0] + (rows[-1] - rows[0]) * shape(kind, alpha) / shape(kind, end)

    np.testing.assert_allclose(pieces[2:, 3], extension(knots[2:-1]), atol=1e-15)
    # Between knots the cubic follows the shape but for the first degree, where it may round a peak.
    beyond = np.linspace(knots[3], HALF_PI, 200) if len(knots) > 4 else knots[-1:]
    with pytest.warns(UserWarning, match="extended"):
        values = curve(table, beyond)
    np.testing.assert_allclose(values, extension(beyond), atol=1e-3 * abs(extension(end)))


def test_a_full_table_is_not_extended(recwarn):
    table = CoefficientTable((0.0, 0.5, 1.5708), (0.1, 0.5, 2.0), "my.csv", "drag")
    knots, coefficients = table.pchip()
    assert knots.tolist() == [0.0, 0.5, HALF_PI]
    assert coefficients.shape == (2, 4)
    assert not recwarn


def test_the_curve_passes_through_the_rows():
    table = CoefficientTable((0.0, 0.5, 1.0, HALF_PI), (0.1, 0.5, 0.4, 2.0), "my.csv", "drag")
    np.testing.assert_allclose(curve(table, np.array(table.alpha)), table.value, atol=1e-14)


@settings(max_examples=50, deadline=None)
@given(
    gaps=st.lists(st.floats(0.01, 1.0), min_size=3, max_size=12),
    rises=st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12),
)
def test_a_rising_table_gives_a_rising_curve(gaps, rises):
    alpha = np.concatenate([[0.0], np.cumsum(gaps)])
    alpha *= HALF_PI / alpha[-1]
    value = np.cumsum([0.1, *rises[: len(gaps)]])
    table = CoefficientTable(tuple(alpha), tuple(value), "my.csv", "drag")
    values = curve(table, np.linspace(0.0, HALF_PI, 400))
    assert np.all(np.diff(values) > -1e-12)
    assert values.max() <= value[-1] + 1e-12


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ("alpha,C\n0,0\n1,1\n", "line 1 is 'alpha,C'"),
        ("", "line 1 is ''"),
        ("alpha_rad,C\n0,0\n1\n2,3\n", "line 3 is '1'"),
        ("alpha_rad,C\n0,zero\n1,1\n2,3\n", "line 2 is '0,zero'"),
        ("alpha_rad,C\n0,0\n1,1\n", "at least 3 rows"),
        ("alpha_rad,C\n0,0\n15,1\n30,2\n", "name the column alpha_deg"),
        ("alpha_rad,C\n0,0\n0.5,1\n0.5,2\n", "row 3 has the angle 0.5 rad, not above"),
        ("alpha_rad,C\n0.1,0\n0.5,1\n0.6,2\n", "start the table at 0"),
        ("alpha_rad,C\n0,0\n0.5,nan\n0.6,2\n", "row 2 is not finite"),
        ("alpha_rad,C\n0,0\n0.5,-1\n0.6,2\n", "row 2 has the drag coefficient -1"),
    ],
)
def test_a_wrong_table_fails_with_file_key_and_row(tmp_path, table, problem):
    file = fish_file(tmp_path, CURVES["tail.drag"], table)
    with pytest.raises(ParameterError) as caught:
        load_fish(file)
    assert str(file) in str(caught.value)
    assert "tail.drag.table" in str(caught.value)
    assert "my.csv" in str(caught.value)
    assert problem in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "rows", "problem"),
    [
        ("lift", (0.1, 0.5, 0.0), "at angle 0"),
        ("impact_moment", (0.1, 0.5, 0.0), "at angle 0"),
        ("lift", (0.0, 0.5, 0.2), "lift at 90 deg"),
    ],
)
def test_a_curve_that_symmetry_forbids_fails(kind, rows, problem):
    with pytest.raises(ParameterError, match=problem):
        CoefficientTable((0.0, 0.8, HALF_PI), rows, "my.csv", kind)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ("tail: {drag: {table: nowhere.csv}}", "cannot read the coefficient table"),
        ("tail: {drag: {table: 3}}", "tail.drag.table is 3"),
        ("tail: {drag: {table: my.csv, c0: 0.1}}", "unknown key tail.drag.c0"),
        ("tail: {area: {table: my.csv}}", "tail.area is {'table'"),
    ],
)
def test_a_wrong_reference_to_a_table_fails(tmp_path, change, problem):
    with pytest.raises(ParameterError, match=r"mine\.yaml") as caught:
        load_fish(fish_file(tmp_path, change, SHORT))
    assert problem in str(caught.value)
