"""What names of columns and topics usually mean. Only names that leave no doubt are here.

English and German words are known: loggers of German tools write decimal commas and such names.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from fish_env.data.units import unit_root

_AXES = ("x", "y", "z")
_ANY = r"(?:[a-z0-9]+_)*"
_BODY = r"(?:(?:fish|robot|body|rigid_body|base|auv|vehicle|marker|center|centre|com)_)*"


@dataclass(frozen=True)
class Name:
    """A name of a column, taken apart.

    Attributes:
        bare: In lower case, words joined by `_`, without a unit.
        unit: The unit that stands in it, or empty.
    """

    bare: str
    unit: str


_BRACKETS = re.compile(r"^(.*?)\s*[\[({]\s*(?:in\s+)?([^\[\](){}]+?)\s*[\])}]\s*$")
_ENDINGS: dict[str, str] = {
    "rad_s": "rad/s", "rads": "rad/s", "rad_per_s": "rad/s", "radps": "rad/s",
    "deg_s": "deg/s", "degs": "deg/s", "deg_per_s": "deg/s", "dps": "deg/s", "degps": "deg/s",
    "m_s": "m/s", "mps": "m/s", "m_per_s": "m/s", "cm_s": "cm/s", "mm_s": "mm/s",
    "rad": "rad", "radians": "rad", "deg": "deg", "degrees": "deg",
    "m": "m", "cm": "cm", "mm": "mm", "meters": "m", "metres": "m",
    "hz": "Hz", "rpm": "rpm",
    "sec": "s", "secs": "s", "seconds": "s", "s": "s", "ms": "ms", "msec": "ms", "millis": "ms",
    "us": "us", "usec": "us", "micros": "us", "ns": "ns", "nsec": "ns", "nanos": "ns",
}  # fmt: skip


def take_apart(column: str) -> Name:
    """Parts a column's name into words and unit: `Pos X [mm]`, `yaw_deg`, `t_ms`."""
    text, unit = column.strip(), ""
    if (found := _BRACKETS.match(text)) and not found[2].isdigit():
        spellings = (found[2], found[2].lower())
        unit = next((spelling for spelling in spellings if unit_root(spelling)), "")
        text = found[1] if unit else text
    # posX and roll-rate are pos_x and roll_rate.
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    bare = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    if not unit:
        for ending in sorted(_ENDINGS, key=len, reverse=True):
            if bare.endswith(f"_{ending}"):
                return Name(bare[: -len(ending) - 1].removesuffix("_in"), _ENDINGS[ending])
    return Name(bare, unit)


def _each(pattern: str) -> dict[str, str]:
    return {axis: pattern.replace("@", axis) for axis in _AXES}


_RATE = r"(?:rate|speed|velocity|vel|dot)"
_ANGLE = r"(?:_?(?:angle|winkel))?"
_POSITION = _each(
    rf"{_ANY}(?:pos|position|translation|point|location)_?@|{_BODY}@(?:_?pos(?:ition)?)?|p@"
)
_QUATERNION = {
    f"q{axis}": rf"{_ANY}(?:orientation|rotation|quaternion|quat|q|attitude)_{axis}"
    rf"|{_ANY}q{axis}|{_ANY}q_?{number}"
    for number, axis in enumerate("wxyz")
}
_LINEAR = _each(
    rf"{_ANY}linear(?:_velocity)?_@|v@_body|{_ANY}body_(?:vel(?:ocity)?|v)_?@"
    rf"|{_ANY}vel(?:ocity)?_body_@"
)
_ANGULAR = _each(
    rf"{_ANY}angular(?:_velocity|_rate|_vel)?_@|{_ANY}(?:gyro|gyr|gyroscope|omega)_?@|w@|g@"
)

CHANNEL_NAMES: Mapping[str, re.Pattern[str]] = {
    name: re.compile(pattern)
    for name, pattern in {
        "x": rf"{_POSITION['x']}|{_ANY}(?:north|northing)",
        "y": rf"{_POSITION['y']}|{_ANY}(?:east|easting)",
        "z": rf"{_POSITION['z']}|{_ANY}down",
        "depth": rf"{_ANY}(?:depth|(?:tauch)?tiefe)",
        "roll": rf"{_ANY}(?:roll|phi){_ANGLE}",
        "pitch": rf"{_ANY}(?:pitch|nick|theta){_ANGLE}",
        "yaw": rf"{_ANY}(?:yaw|gier|psi|heading|compass|kurs){_ANGLE}",
        "u": rf"u|{_ANY}surge(?:_speed|_velocity|_vel)?|{_LINEAR['x']}",
        "v": rf"v|{_ANY}sway(?:_speed|_velocity|_vel)?|{_LINEAR['y']}",
        "w": rf"w|{_ANY}heave(?:_speed|_velocity|_vel)?|{_LINEAR['z']}",
        "p": rf"p|{_ANY}roll_?{_RATE}|{_ANGULAR['x']}",
        "q": rf"q|{_ANY}(?:pitch|nick)_?{_RATE}|{_ANGULAR['y']}",
        "r": rf"r|{_ANY}(?:yaw|gier)_?{_RATE}|{_ANGULAR['z']}",
        "tail_angle": rf"{_ANY}tail(?:_joint|_servo)?_(?:angle|position|pos|feedback|encoder)"
        r"|(?:\w+_)?position_\w*tail\w*",
        **_QUATERNION,
    }.items()
}
"""How the column of a channel may be called."""

UPWARD = re.compile(rf"{_ANY}(?:up|altitude|height|alt)")
"""How z may be called where it grows upwards."""

COMPASS = re.compile(rf"{_ANY}(?:heading|compass|kurs){_ANGLE}")
"""A yaw so called is measured from north, clockwise."""

PLANAR = re.compile(rf"{_ANY}theta{_ANGLE}")
"""The yaw of a pose in the plane, beside x and y and no other angle."""

GEOGRAPHIC = re.compile(rf"{_ANY}(?:north|northing|east|easting|down)")
"""Names that are x, y or z of the frame ned whatever the frame of the others is."""

COMMAND_NAMES: Mapping[str, re.Pattern[str]] = {
    name: re.compile(pattern)
    for name, pattern in {
        "tail_offset": rf"(?:{_ANY}(?:tail|schwanz)_?)?"
        rf"(?:(?:offset|bias|versatz){_ANGLE}|mean_angle)",
        "tail_amplitude": rf"{_ANY}(?:(?:schwanz)?amplitude|amp|ampl)",
        "tail_frequency": rf"{_ANY}(?:frequency|freq|beat_rate|(?:schwanz|schlag)?frequenz)",
        "block_displacement": rf"{_ANY}(?:block|mass|slider|weight)"
        r"_(?:displacement|position|pos|shift)",
        "block_angle": rf"{_ANY}(?:block|mass|weight)_(?:angle|rotation)",
    }.items()
}
"""How the column or topic of a command may be called, once words for commanding are taken off."""

COMMANDING = frozenset(
    ["cmd", "cmds", "command", "commands", "commanded", "desired", "des", "ref", "reference",
     "setpoint", "set", "sp", "target", "goal", "servo", "request", "requested"]
)  # fmt: skip
"""Words for what is asked for rather than measured."""

_CARRIERS = frozenset(["data", "value", "val", "values"])

TIME_NAMES = re.compile(
    rf"t|{_ANY}(?:time|timestamp|stamp|clock|epoch|elapsed|datetime|date|utc"
    r"|(?:uhr)?zeit|datum)(?:_utc)?"
    r"|secs?|seconds|millis|micros|nanos|ms|us|ns"
)
RUN_NAMES = re.compile(r"(?:run|trial|test|experiment|episode)(?:_?(?:id|no|nr|number|name))?")


def command_name(part: str, column: str) -> tuple[str, bool]:
    """The words of a column that may be a command.

    Args:
        part: Topic, sheet or variable it is in, which counts where the column is a mere `data`.
        column: Name of the column.

    Returns:
        The words without those for commanding, and whether there were any of those.
    """
    bare = take_apart(column).bare
    context = take_apart(part.strip("/")).bare
    if bare in _CARRIERS:
        bare, context = context, ""
    words = bare.split("_")
    kept = [word for word in words if word not in COMMANDING]
    asked = len(kept) < len(words) or bool(COMMANDING & set(context.split("_")))
    return "_".join(kept), asked
