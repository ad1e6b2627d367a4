"""The tiers: how many runs, what is measured and how well, and what may be hidden."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tests.hidden.measurement import ALL_CHANNELS, CAMERA_CHANNELS
from tests.hidden.sizes import FOREIGN_SIZES, INVISIBLE, SIZES

DEGREE = math.radians(1.0)
SENSORS = {
    **dict.fromkeys(("x", "y", "z"), 0.002),
    **dict.fromkeys(("roll", "pitch", "yaw"), 0.3 * DEGREE),
    **dict.fromkeys(("p", "q", "r"), 0.01),
}
CAMERA = {**dict.fromkeys(("x", "y", "z"), 0.002), "yaw": 0.5 * DEGREE}
SINGLE = tuple((name,) for name in SIZES)


@dataclass(frozen=True)
class Plan:
    """One tier.

    Attributes:
        choices: effects that act together, one entry a case; empty for none.
        strength: size of each, 1 is typical.
        moved: fewest and most baseline coefficients that are off (end excluded).
        runs: number of runs.
        duration: of each, s.
        rate: samples per second.
        noise: one-sigma value by channel.
        missing: share of samples that are lost.
        start: "rest" with known tail phase, or "unknown".
        schedule: "exciting", "controller" or one of the poor ones.
        depth: range of the start depth, m.
        colours: colours of the disturbance, one is drawn.
        force: range of its rms force, N.
        memory: range of its correlation time, s.
        visible: whether the runs can show the effects.
        steady: whether the data are a table of steady motion.
    """

    choices: tuple[tuple[str, ...], ...] = ()
    strength: float = 1.0
    moved: tuple[int, int] | None = None
    runs: int = 8
    duration: float = 30.0
    rate: float = 25.0
    noise: Mapping[str, float] = field(default_factory=lambda: SENSORS)
    missing: float = 0.0
    start: str = "rest"
    schedule: str = "exciting"
    depth: tuple[float, float] = (0.2, 1.2)
    colours: tuple[str, ...] = ("ou",)
    force: tuple[float, float] = (0.002, 0.004)
    memory: tuple[float, float] = (0.3, 1.5)
    visible: bool = True
    steady: bool = False


RICH = Plan(SINGLE)
NOT_BY_CAMERA = ("gyro_bias", *INVISIBLE)
PAIRS = (
    ("servo_lag", "current"),
    ("added_mass", "buoyancy_offset"),
    ("tail_reactive", "gyro_bias"),
    ("block_scale", "linear_drag"),
    ("frequency_scale", "tether"),
    ("wake_fraction", "sensor_delay"),
    ("servo_delay", "hull_compression"),
    ("tail_bias", "added_mass"),
    ("battery_sag", "block_lag"),
    ("position_scale", "quadratic_damping"),
    ("attitude_misalignment", "tail_gain"),
    ("cross_flow_drag", "water_ingress"),
    ("offset_drag", "wave"),
    ("clock_scale", "wake_memory"),
    ("servo_backlash", "surface_drag"),
    ("tail_asymmetry", "block_reaction"),
)
TRIPLES = (
    ("servo_lag", "current", "buoyancy_offset"),
    ("added_mass", "linear_drag", "tail_bias"),
    ("tail_reactive", "block_lag", "gyro_bias"),
    ("wake_fraction", "water_ingress", "sensor_delay"),
    ("frequency_scale", "attitude_misalignment", "quadratic_damping"),
    ("servo_delay", "block_scale", "current"),
)
STEADY_TABLE = (
    (),
    ("tail_bias",),
    ("tail_gain",),
    ("servo_lag",),
    ("frequency_scale",),
    ("linear_drag",),
    ("wake_fraction",),
    ("offset_drag",),
    ("tail_reactive",),
    ("tail_flexibility",),
    ("buoyancy_offset",),
    ("block_scale",),
)
STRONG = {
    "colours": ("ou", "band", "pink", "steps"),
    "force": (0.005, 0.010),
    "memory": (1.0, 5.0),
}
AS_CAMERA = replace(
    RICH,
    choices=tuple((name,) for name in SIZES if name not in NOT_BY_CAMERA),
    rate=15.0,
    noise=CAMERA,
    missing=0.02,
    start="unknown",
)
CLOSED = replace(
    RICH, choices=tuple((n,) for n in SIZES if n not in INVISIBLE), schedule="controller"
)
DESIGNS: dict[str, Plan] = {
    "four runs of a minute at 50 Hz": replace(RICH, runs=4, duration=60.0, rate=50.0),
    "twelve runs of 10 s at 10 Hz": replace(RICH, runs=12, duration=10.0, rate=10.0),
    "two runs": replace(RICH, runs=2),
    "four times the noise": replace(RICH, noise={c: 4.0 * sd for c, sd in SENSORS.items()}),
    "gyro, compass and depth, a tenth missing": replace(
        RICH, noise={c: SENSORS[c] for c in ("z", "yaw", "p", "q", "r")}, missing=0.1
    ),
    "speeds, attitude and depth": replace(
        RICH,
        noise=dict.fromkeys(("u", "v", "w"), 0.01)
        | {c: SENSORS[c] for c in ("z", "roll", "pitch", "yaw")},
    ),
    "unknown starts, 30 % missing": replace(RICH, start="unknown", missing=0.3),
    "strong slow pushes of any colour": replace(RICH, **STRONG),
    "twice the size": replace(RICH, strength=2.0),
}
"""Experiments of other people."""
SHORT = Plan(runs=3, duration=12.0, visible=False)
PLANS: dict[str, Plan] = {
    "rich": RICH,
    "small": replace(RICH, strength=0.3),
    "null": replace(RICH, choices=()),
    "null_strong": replace(RICH, choices=(), **STRONG),
    "camera": AS_CAMERA,
    "null_camera": replace(AS_CAMERA, choices=()),
    "closed_loop": CLOSED,
    "null_closed_loop": replace(CLOSED, choices=()),
    "pairs": replace(RICH, choices=PAIRS),
    "triples": replace(RICH, choices=TRIPLES),
    "outside": replace(RICH, choices=tuple((name,) for name in FOREIGN_SIZES)),
    "coefficients": replace(RICH, choices=(), moved=(1, 4)),
    "designs": replace(RICH, choices=AS_CAMERA.choices),
    "null_designs": replace(RICH, choices=()),
    "poor": SHORT,
    "steady": Plan(
        STEADY_TABLE,
        noise={"surge_speed": 0.002, "sway_speed": 0.002, "yaw_rate": 0.005, "pitch": 0.005},
        steady=True,
    ),
}
POOR_CASES: tuple[tuple[str, str], ...] = (
    ("block_lag", "without_block"),
    ("servo_lag", "without_tail"),
    ("offset_drag", "without_offset"),
    ("block_scale", "steady_straight"),
    ("frequency_scale", "without_tail"),
    ("servo_rate_limit", "slow_strokes"),
    ("block_reaction", "without_block"),
    ("tail_gain", "without_tail"),
    ("surface_drag", "deep"),
    ("tail_asymmetry", "without_tail"),
)
"""An effect, and runs that cannot show it: its signal in them is zero, or next to it."""


def poor(name: str, schedule: str) -> Plan:
    """Runs that cannot show an effect."""
    if schedule == "deep":
        return replace(SHORT, choices=((name,),), depth=(2.0, 2.2))
    return replace(SHORT, choices=((name,),), schedule=schedule)


def designed(tier: str) -> tuple[Plan, ...]:
    """Every experiment of other people, twice."""
    choices = PLANS[tier].choices
    return tuple(replace(plan, choices=choices) for plan in DESIGNS.values() for _ in range(2))


KINDS = {
    "poor": tuple(poor(name, schedule) for name, schedule in POOR_CASES),
    "designs": designed("designs"),
    "null_designs": designed("null_designs"),
}
"""Tiers of several kinds of experiments, which consecutive numbers go through in order."""


def plan_of(tier: str, seed: int) -> Plan:
    """The plan of one case.

    Raises:
        KeyError: No such tier.
    """
    kinds = KINDS.get(tier, (PLANS[tier],))
    return kinds[seed % len(kinds)]


assert set(SENSORS) == set(ALL_CHANNELS)
assert set(CAMERA) == set(CAMERA_CHANNELS)
assert not set(SIZES) & set(FOREIGN_SIZES)
