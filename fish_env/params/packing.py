"""From validated parameters to the flat record that kernels read.

A record is a column of float64 numbers in the order of :data:`RECORD_FIELDS`; a batch of fish is
an array of shape (number of fields, number of fish). Four fields are derived, because they
depend on parameters alone and would cost a division in every evaluation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fish_env.arrays import FloatArray

if TYPE_CHECKING:
    from fish_env.params.schema import FishParams


PATHS: dict[str, str] = {
    "density": "water.density",
    "gravity": "water.gravity",
    "mass_total": "mass.total",
    "mass_buoyancy": "mass.buoyancy",
    "mass_block": "mass.weight_block",
    "static_x": "mass.static_moment_rest[0]",
    "static_y": "mass.static_moment_rest[1]",
    "static_z": "mass.static_moment_rest[2]",
    "inertia_rest_x": "inertia.rest[0]",
    "inertia_rest_y": "inertia.rest[1]",
    "inertia_rest_z": "inertia.rest[2]",
    "inertia_block_x": "inertia.weight_block[0]",
    "inertia_block_y": "inertia.weight_block[1]",
    "inertia_block_z": "inertia.weight_block[2]",
    "bracket_x": "weight_block.bracket_origin[0]",
    "bracket_y": "weight_block.bracket_origin[1]",
    "bracket_z": "weight_block.bracket_origin[2]",
    "d1": "weight_block.d1",
    "d2": "weight_block.d2",
    "d3": "weight_block.d3",
    "s_w0": "weight_block.s_w0",
    "crank_l1": "weight_block.crank.l1",
    "crank_l2": "weight_block.crank.l2",
    "tail_root_x": "tail.root[0]",
    "tail_root_y": "tail.root[1]",
    "tail_root_z": "tail.root[2]",
    "tail_r_c": "tail.center_of_pressure",
    "tail_area": "tail.area",
    "tail_c0": "tail.drag.c0",
    "tail_c2": "tail.drag.c2",
    "tail_c1": "tail.lift.c1",
    "area_x": "body.area[0]",
    "area_y": "body.area[1]",
    "area_z": "body.area[2]",
    "xz_c0": "body.plane_xz.drag.c0",
    "xz_c2": "body.plane_xz.drag.c2",
    "xz_c1": "body.plane_xz.lift.c1",
    "xz_k": "body.plane_xz.impact_moment",
    "xy_c0": "body.plane_xy.drag.c0",
    "xy_c2": "body.plane_xy.drag.c2",
    "xy_c1": "body.plane_xy.lift.c1",
    "xy_k": "body.plane_xy.impact_moment",
    "damping_x": "body.rotational_damping[0]",
    "damping_y": "body.rotational_damping[1]",
    "damping_z": "body.rotational_damping[2]",
}
"""Record field -> path in the parameter file."""

DERIVED = (
    "inverse_mass",
    "inertia_rest_ob_x",
    "inertia_rest_ob_y",
    "inertia_rest_ob_z",
)
RECORD_FIELDS: tuple[str, ...] = (*PATHS, *DERIVED)

CURVES = (
    "tail.drag",
    "tail.lift",
    "body.plane_xz.drag",
    "body.plane_xz.lift",
    "body.plane_xz.impact_moment",
    "body.plane_xy.drag",
    "body.plane_xy.lift",
    "body.plane_xy.impact_moment",
)
"""Coefficient curves that a user's own table may replace, in the order kernels index them."""


def pack_values(values: Mapping[str, float | FloatArray]) -> FloatArray:
    """Pack path -> value (a number, or one per fish) into records of shape (fields, fish).

    Paths that are absent were replaced by a coefficient table; their field is zero, and the
    forces do not read it.
    """
    columns = [np.atleast_1d(np.asarray(values.get(path, 0.0), float)) for path in PATHS.values()]
    count = max(column.size for column in columns)
    record = np.empty((len(RECORD_FIELDS), count))
    for row, column in enumerate(columns):
        record[row] = column
    derive(record)
    return record


def pack(fish: FishParams) -> FloatArray:
    """Record of one fish, shape (fields,)."""
    return pack_values(fish.values())[:, 0].copy()


def derive(record: FloatArray) -> None:
    """Fill in the derived fields, in place: 1/m_total, and J'_ew + m_ew r(C_ew)^2 about O_b."""
    at = {name: record[row] for row, name in enumerate(RECORD_FIELDS)}
    at["inverse_mass"][:] = 1.0 / at["mass_total"]
    mass_rest = at["mass_total"] - at["mass_block"]
    centre = [at[f"static_{axis}"] / mass_rest for axis in "xyz"]
    squares = [component * component for component in centre]
    for axis, name in enumerate("xyz"):
        others = [square for other, square in enumerate(squares) if other != axis]
        at[f"inertia_rest_ob_{name}"][:] = at[f"inertia_rest_{name}"] + mass_rest * sum(others)


def pack_tables(fish: FishParams) -> FloatArray:
    """Coefficient tables as (curve, knot, 5): angle of the knot, then the cubic's c3 c2 c1 c0.

    A curve without a table has a negative first angle. A fish without tables gives shape (0, 0, 0).
    """
    tables = fish.tables()
    if not tables:
        return np.zeros((0, 0, 0))
    pieces = {name: table.pchip() for name, table in tables.items()}
    longest = max(len(knots) for knots, _ in pieces.values())
    packed = np.full((len(CURVES), longest, 5), np.inf)
    packed[:, 0, 0] = -1.0
    for name, (knots, coefficients) in pieces.items():
        curve = packed[CURVES.index(name)]
        curve[: len(knots), 0] = knots
        curve[: len(knots) - 1, 1:] = coefficients
    return packed
