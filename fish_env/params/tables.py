"""A user's own coefficient curve: a table of angle of attack and coefficient.

A table replaces one analytic curve of the model, drag, lift or impact moment of the tail or of one
body plane. It is interpolated by a monotone cubic (Fritsch and Carlson, as in scipy's
`PchipInterpolator`), which neither overshoots nor rings between the rows. The oscillating tail
meets angles up to 90 degrees in every stroke, so a table that ends earlier is extended by the shape
of the analytic curve through its last row.
"""

import csv
import dataclasses
import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.errors import ParameterError
from fish_env.files import write_text
from fish_env.reading import Unreadable, plain_number, read_text, short

TableKind = Literal["drag", "lift", "impact_moment"]

HALF_PI = 0.5 * math.pi
EXTENSION_STEP = math.radians(1.0)
# Angles typed with four decimals (1.5708) land a hair beyond pi/2; they mean pi/2.
ROUNDING = 5e-5
MIN_ROWS = 3
HEAD = "alpha_rad,C"
"""First line of the tables that are written."""
ANGLE_SCALE = {"alpha_rad": 1.0, "alpha_deg": math.pi / 180.0}


@dataclasses.dataclass(frozen=True)
class CoefficientTable:
    """One coefficient against the angle of attack.

    Attributes:
        alpha: Angles of attack, rad, from 0 increasing to at most pi/2, shape (n,), n >= 3.
        value: Coefficient at each angle, shape (n,). Dimensionless; m for an impact moment, whose
            negative angles follow by odd symmetry.
        source: Where the rows come from, a file path as a rule; does not count in comparisons.
        kind: The curve it replaces, which decides how it is extended.

    Raises:
        ParameterError: The rows do not describe such a curve; names the source and the row.
    """

    alpha: tuple[float, ...]
    value: tuple[float, ...]
    source: str = dataclasses.field(compare=False)
    kind: TableKind

    def __post_init__(self) -> None:
        object.__setattr__(self, "alpha", tuple(snap(float(a)) for a in self.alpha))
        object.__setattr__(self, "value", tuple(float(c) for c in self.value))
        check_rows(self)
        check_shape(self)

    def pchip(self) -> tuple[FloatArray, FloatArray]:
        """Interpolates the table by a monotone cubic over 0 to pi/2.

        Beyond the last angle a_n, with value C_n, the curve goes on as the analytic form does:
        drag C_0 + (C_n - C_0) sin^2 a / sin^2 a_n, lift and impact moment
        C_n sin a cos a / (sin a_n cos a_n), in knots one degree apart at most. Where the two meet
        at a peak, the monotone cubic rounds it within the first degree.

        Returns:
            Knots, rad, shape (n,), the first 0 and the last pi/2; and polynomial coefficients,
            shape (n - 1, 4), highest power first: on interval i the curve is
            c[i, 0] h^3 + c[i, 1] h^2 + c[i, 2] h + c[i, 3] with h = |alpha| - knots[i].

        Warns:
            UserWarning: The table ends before pi/2 and was extended; names the source and angle.
        """
        from scipy.interpolate import PchipInterpolator

        alpha, value = np.array(self.alpha), np.array(self.value)
        if alpha[-1] < HALF_PI:
            warnings.warn(extension_notice(self), UserWarning, stacklevel=2)
            beyond = extension_angles(float(alpha[-1]))
            value = np.concatenate([value, extension_values(self, beyond)])
            alpha = np.concatenate([alpha, beyond])
        return alpha, np.ascontiguousarray(PchipInterpolator(alpha, value).c.T)


def snap(alpha: float) -> float:
    """Returns pi/2 for an angle that is pi/2 up to the rounding of a typed number."""
    return HALF_PI if abs(alpha - HALF_PI) < ROUNDING else alpha


def extension_angles(last: float) -> FloatArray:
    """Returns the knots beyond the last angle of a table up to pi/2, rad, one degree apart."""
    count = math.ceil((HALF_PI - last) / EXTENSION_STEP)
    return np.linspace(last, HALF_PI, count + 1)[1:]


def extension_values(table: CoefficientTable, alpha: FloatArray) -> FloatArray:
    """Continues a table by the shape of the analytic curve through its last row."""
    last, end = table.alpha[-1], table.value[-1]
    if table.kind == "drag":
        start = table.value[0]
        return start + (end - start) * np.sin(alpha) ** 2 / math.sin(last) ** 2
    # sin a cos a = sin(2a) / 2; rounding would leave 1e-16 at pi/2, where the curve is zero.
    return np.where(alpha == HALF_PI, 0.0, end * np.sin(2 * alpha) / math.sin(2 * last))


def analytic_tail(tables: Mapping[str, CoefficientTable]) -> dict[str, float]:
    """Coefficients of analytic curves that are close to the tables of a tail, by path.

    Where only the moment about the hinge counts: through the drag at 0 and 90 degrees, and
    through the lift at 45.
    """
    close: dict[str, float] = {}
    if "tail.drag" in tables:
        drag = tables["tail.drag"]
        rise = float(extension_values(drag, np.array([HALF_PI]))[0]) - drag.value[0]
        close |= {"tail.drag.c0": drag.value[0], "tail.drag.c2": rise}
    if "tail.lift" in tables:
        lift = tables["tail.lift"]
        half = np.array([0.5 * HALF_PI])
        within = lift.alpha[-1] >= half[0]
        at = np.interp(half, lift.alpha, lift.value) if within else extension_values(lift, half)
        close["tail.lift.c1"] = 2.0 * float(at[0])
    return close


def extension_notice(table: CoefficientTable) -> str:
    """Words the warning for a table that ends before pi/2."""
    shape = "C(0) + k sin^2(alpha)" if table.kind == "drag" else "k sin(alpha) cos(alpha)"
    return (
        f"{table.source}: the {table.kind} table ends at {table.alpha[-1]:.4f} rad "
        f"({math.degrees(table.alpha[-1]):.1f} deg); up to 90 deg it is extended as {shape} "
        "through its last row. Add rows up to 90 deg to avoid this."
    )


def check_rows(table: CoefficientTable) -> None:
    """Checks number, order and range of the rows."""
    if len(table.alpha) != len(table.value) or len(table.alpha) < MIN_ROWS:
        raise ParameterError(
            f"{table.source}: {len(table.alpha)} angles and {len(table.value)} coefficients; "
            f"a table needs at least {MIN_ROWS} rows of one each"
        )
    for row, (alpha, value) in enumerate(zip(table.alpha, table.value, strict=True), start=1):
        if not (math.isfinite(alpha) and math.isfinite(value)):
            raise ParameterError(f"{table.source}: row {row} is not finite; give plain numbers")
        if alpha > HALF_PI:
            raise ParameterError(
                f"{table.source}: row {row} has the angle {alpha:.6g} rad, beyond pi/2; "
                "if the angles are in degrees, name the column alpha_deg"
            )
        if row > 1 and alpha <= table.alpha[row - 2]:
            raise ParameterError(
                f"{table.source}: row {row} has the angle {alpha:.6g} rad, not above the row "
                "before it; sort the rows by angle and keep one row per angle"
            )
    if table.alpha[0] != 0.0:
        raise ParameterError(
            f"{table.source}: row 1 has the angle {table.alpha[0]:.6g} rad; start the table at 0"
        )


def check_shape(table: CoefficientTable) -> None:
    """Checks what symmetry and energy ask of a curve: no thrust from drag, no lift at 0 or 90."""
    if table.kind == "drag":
        for row, value in enumerate(table.value, start=1):
            if value < 0:
                raise ParameterError(
                    f"{table.source}: row {row} has the drag coefficient {value:.6g}; a negative "
                    "drag would drive the fish, give values of at least 0"
                )
        return
    if table.value[0] != 0.0:
        raise ParameterError(
            f"{table.source}: the {table.kind} at angle 0 is {table.value[0]:.6g}; a symmetric "
            "section has none there, set it to 0"
        )
    if table.kind == "lift" and table.alpha[-1] == HALF_PI and table.value[-1] != 0.0:
        raise ParameterError(
            f"{table.source}: the lift at 90 deg is {table.value[-1]:.6g}; the flow is square to "
            "the plate there and lift has no direction, set it to 0 or end the table earlier"
        )


def read_table(path: Path, kind: TableKind) -> CoefficientTable:
    """Reads a coefficient table from a CSV file with the header `alpha_rad,C` or `alpha_deg,C`.

    Raises:
        ParameterError: The file is missing or is not such a table; names file, line and remedy.
    """
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except FileNotFoundError:
        raise ParameterError(
            f"{path}: cannot read the coefficient table, there is no such file; check the path"
        ) from None
    except Unreadable as error:
        raise ParameterError(f"{path}: the coefficient table {error}") from error
    except csv.Error as error:
        raise ParameterError(f"{path}: no CSV table ({error}); check its quotation marks") from None
    scale = read_header(path, rows[0] if rows else [])
    pairs = [read_row(path, line, row) for line, row in enumerate(rows[1:], start=2) if row]
    return CoefficientTable(
        alpha=tuple(alpha * scale for alpha, _ in pairs),
        value=tuple(value for _, value in pairs),
        source=str(path),
        kind=kind,
    )


def read_header(path: Path, header: list[str]) -> float:
    """Returns the factor from the file's angle unit to radians."""
    names = [name.strip() for name in header]
    if len(names) != 2 or names[0] not in ANGLE_SCALE or names[1] != "C":
        raise ParameterError(
            f"{path}: line 1 is '{short(','.join(header))}'; the header must be alpha_rad,C "
            "or alpha_deg,C"
        )
    return ANGLE_SCALE[names[0]]


def read_row(path: Path, line: int, row: list[str]) -> tuple[float, float]:
    """Reads one line as an angle and a coefficient."""
    try:
        alpha, value = map(plain_number, row)
        if any(math.isnan(plain_number(c)) and c.strip().lower() != "nan" for c in row):
            raise ValueError
    except ValueError as error:
        raise ParameterError(
            f"{path}: line {line} is '{short(','.join(row))}'; give two numbers, angle and "
            "coefficient"
        ) from error
    return alpha, value


def write_table(table: CoefficientTable, path: Path) -> None:
    """Writes a table to a CSV file below `HEAD`, in radians, with every digit."""
    lines = [f"{a!r},{c!r}" for a, c in zip(table.alpha, table.value, strict=True)]
    write_text(path, "\n".join([HEAD, *lines, ""]))
