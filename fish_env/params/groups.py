"""The parameter groups of a fish, mirroring the sections of its YAML file one to one.

Symbols are those of the model's equations. Lengths and positions are in the body frame, x forward,
y starboard, z down, from the centre of buoyancy O_b. Bounds are physical limits for any swimming
robot of laboratory size, not a guess about one fish; that is what the priors are for.
"""

import dataclasses

from fish_env.params.fields import PriorGroup, Spec, number, section, vector
from fish_env.params.tables import CoefficientTable

Vector3 = tuple[float, float, float]

TINY_MASS, HUGE_MASS = 1e-6, 1e4
TINY_LENGTH, HUGE_LENGTH = 1e-6, 10.0
TINY_INERTIA, HUGE_INERTIA = 1e-12, 1e4
TINY_AREA, HUGE_AREA = 1e-9, 100.0


def mass(symbol: str, description: str, prior: PriorGroup = "mass") -> Spec:
    """Declares a mass, kg; zero is not a mass."""
    return Spec("kg", symbol, description, TINY_MASS, HUGE_MASS, prior)


def position(symbol: str, description: str) -> Spec:
    """Declares a signed length, m."""
    return Spec("m", symbol, description, -HUGE_LENGTH, HUGE_LENGTH, "geometry")


def length(symbol: str, description: str) -> Spec:
    """Declares a length, m; zero is not a length."""
    return Spec("m", symbol, description, TINY_LENGTH, HUGE_LENGTH, "geometry")


def surface(symbol: str, description: str) -> Spec:
    """Declares an area, m^2; zero is not an area."""
    return Spec("m^2", symbol, description, TINY_AREA, HUGE_AREA, "geometry")


def principal_inertia(symbol: str, description: str) -> Spec:
    """Declares principal moments of inertia, kg m^2, all positive."""
    return Spec("kg m^2", symbol, description, TINY_INERTIA, HUGE_INERTIA, "inertia")


def coefficient(symbol: str, description: str) -> Spec:
    """Declares a dimensionless force coefficient; a negative one would drive the fish."""
    return Spec("-", symbol, description, 0.0, 100.0, "hydrodynamic")


@dataclasses.dataclass(frozen=True)
class Water:
    """The water and the gravity field; both are taken as known."""

    density: float = number(
        Spec("kg/m^3", "rho", "water density; 0 switches all hydrodynamic forces off", 0.0, 2e4)
    )
    gravity: float = number(Spec("m/s^2", "g", "gravitational acceleration", 0.0, 100.0))


@dataclasses.dataclass(frozen=True)
class Mass:
    """Masses and the balance of the fish."""

    total: float = number(mass("m_total", "mass of the whole fish, weight block included"))
    buoyancy: float = number(mass("m_b", "mass of the displaced water", "trim"))
    weight_block: float = number(mass("m_w", "mass of the movable weight block"))
    static_moment_rest: Vector3 = vector(
        Spec(
            "kg m",
            "M_ew",
            "mass times centre of mass of everything but the block",
            -1e3,
            1e3,
            "static_moment",
        )
    )


@dataclasses.dataclass(frozen=True)
class Inertia:
    """Principal moments of inertia about the parts' own centres of mass."""

    rest: Vector3 = vector(principal_inertia("J'_ew", "moments of everything but the block"))
    weight_block: Vector3 = vector(principal_inertia("J'_w", "moments of the weight block"))


@dataclasses.dataclass(frozen=True)
class Crank:
    """Rods of the crank-slider that shifts the weight block; l1 turns inside l2's reach."""

    l1: float = number(length("l1", "crank of the crank-slider"))
    l2: float = number(length("l2", "connecting rod of the crank-slider"))


@dataclasses.dataclass(frozen=True)
class WeightBlock:
    """Where the weight block hangs and how far it can be shifted."""

    bracket_origin: Vector3 = vector(position("a_rb, b_rb, c_rb", "origin of the rotating bracket"))
    d1: float = number(position("d1", "axial distance from the bracket's origin to the slider"))
    d2: float = number(position("d2", "radius at which the block hangs from the bracket's axis"))
    d3: float = number(position("d3", "axial distance from the slider to the block's centre"))
    s_w0: float = number(position("s_w0", "slider position at rest"))
    crank: Crank = section(Crank)


@dataclasses.dataclass(frozen=True)
class DragCoefficients:
    """Analytic drag curve C_D = c0 + c2 sin^2|alpha|."""

    c0: float = number(coefficient("c0", "drag coefficient at zero angle of attack"))
    c2: float = number(coefficient("c2", "rise of the drag coefficient up to 90 degrees"))


@dataclasses.dataclass(frozen=True)
class LiftCoefficients:
    """Analytic lift curve C_L = c1 sin|alpha| cos|alpha|."""

    c1: float = number(coefficient("c1", "slope of the lift coefficient at zero angle of attack"))


IMPACT_MOMENT = Spec(
    "m", "k", "factor of the impact moment k sin(alpha) cos(alpha)", -10.0, 10.0, "hydrodynamic"
)


@dataclasses.dataclass(frozen=True)
class Tail:
    """The oscillating tail, one rigid plate."""

    root: Vector3 = vector(position("a_t, b_t, c_t", "tail joint"))
    center_of_pressure: float = number(length("r_c", "tail joint to the centre of pressure"))
    area: float = number(surface("S_t", "area of the tail"))
    drag: DragCoefficients | CoefficientTable = section(DragCoefficients, table="drag")
    lift: LiftCoefficients | CoefficientTable = section(LiftCoefficients, table="lift")


@dataclasses.dataclass(frozen=True)
class Plane:
    """Forces on the hull from the flow within one of its planes."""

    drag: DragCoefficients | CoefficientTable = section(DragCoefficients, table="drag")
    lift: LiftCoefficients | CoefficientTable = section(LiftCoefficients, table="lift")
    impact_moment: float | CoefficientTable = number(IMPACT_MOMENT, table="impact_moment")


@dataclasses.dataclass(frozen=True)
class Body:
    """The hull: projected areas, coefficients by plane, rotational damping."""

    area: Vector3 = vector(surface("S_xx, S_yy, S_zz", "area projected along each body axis"))
    plane_xz: Plane = section(Plane)
    plane_xy: Plane = section(Plane)
    rotational_damping: Vector3 = vector(
        Spec("N m s/rad", "C_omega", "damping moment per angular rate", -1e3, 0.0, "damping")
    )


PRIOR_LIMIT = 10.0


@dataclasses.dataclass(frozen=True)
class Prior:
    """How far each group of parameters may be off: relative standard deviations."""

    mass: float = number(Spec("-", "", "masses", 0.0, PRIOR_LIMIT))
    inertia: float = number(Spec("-", "", "moments of inertia", 0.0, PRIOR_LIMIT))
    geometry: float = number(Spec("-", "", "lengths, areas, balance", 0.0, PRIOR_LIMIT))
    hydrodynamic: float = number(Spec("-", "", "force coefficients", 0.0, PRIOR_LIMIT))
    damping: float = number(Spec("-", "", "rotational damping", 0.0, PRIOR_LIMIT))
