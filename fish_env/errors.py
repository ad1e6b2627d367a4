"""Every error a user of the package can meet, each saying what to change."""

import re
from collections.abc import Sequence
from importlib import metadata

_EXTRA = re.compile(r"extra == ['\"]([^'\"]+)['\"]")


class RoboticFishError(Exception):
    """Base of all errors the package raises on purpose; catch it to catch them all."""


class ParameterError(RoboticFishError):
    """Raised when a fish, its file, or a value put into it is not a possible fish."""


class DatasetError(RoboticFishError):
    """Raised when measured data cannot be read as declared, or would have to be guessed at."""


class ScheduleError(RoboticFishError):
    """Raised when a command schedule is out of order, incomplete or beyond the actuators."""


class EffectError(RoboticFishError):
    """Raised for an unknown effect, an unknown effect parameter, or a value it cannot take."""


class ConfigError(RoboticFishError):
    """Raised when an environment, training or benchmark configuration is wrong."""


class OutputError(RoboticFishError, OSError):
    """Raised when a file cannot be written, or when writing it would replace one that is read."""


class Interrupted(RoboticFishError):
    """Raised when a person stops a command; says what was kept and how to go on."""


class MissingExtraError(RoboticFishError, ImportError):
    """Raised when a feature needs a package that only an optional extra installs."""


class SimulationDiverged(RoboticFishError):
    """Raised when the state stops being finite.

    Attributes:
        time_s: Simulated time of the first bad step, s.
        state: The last finite state.
    """

    def __init__(self, time_s: float, state: Sequence[float]) -> None:
        # Both values go to the base class so that the error can be pickled across processes.
        super().__init__(time_s, state)
        self.time_s = time_s
        self.state = state

    def __str__(self) -> str:
        numbers = ", ".join(f"{float(value):.4g}" for value in self.state)
        return (
            f"the simulation diverged at t = {self.time_s:.4f} s; last finite state [{numbers}]. "
            "Use a smaller time step, or check the parameters and commands for extreme values."
        )


def missing_extra(purpose: str, package: str, extra: str) -> MissingExtraError:
    """Words the error for an optional package that is not installed.

    Args:
        purpose: What the user asked for, as the start of a sentence, "Training a policy".
        package: The package that could not be imported.
        extra: The extra of the `robotic-fish` distribution that installs it.

    Returns:
        The error, to be raised by the caller from the `ImportError`.
    """
    return MissingExtraError(
        f"{purpose} needs the package '{package}', which is not installed. "
        f"Install it with: {_pip_line(extra) or f'pip install {package}'}"
    )


def _pip_line(extra: str) -> str:
    """The line that installs what an extra asks for; empty where the package is not installed.

    The project is on no package index, so its extras cannot be named there. Their contents can.
    """
    try:
        wanted = metadata.requires("robotic-fish") or []
    except metadata.PackageNotFoundError:
        return ""
    parts = (line.partition(";") for line in wanted)
    names = [name.strip() for name, _, marker in parts if _EXTRA.findall(marker) == [extra]]
    return f"pip install {' '.join(f'{chr(34)}{name}{chr(34)}' for name in names)}" if names else ""
