"""Independent tasks on a cluster, whose results come as they are done."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fish_env.errors import ConfigError, RoboticFishError
from fish_env.version import VERSION

P = TypeVar("P")
R = TypeVar("R")
RETRIES = 3
"""How often a task is started again whose process or machine died."""
AHEAD = 2
"""Tasks handed out for each one that can run, so that no core waits; more would fill memory."""
LOOK_EVERY_S = 5.0
"""How often the size of the cluster is looked at while nothing ends."""


@dataclass(frozen=True)
class Task(Generic[P]):
    """One thing to do.

    Attributes:
        name: tells it from the others, in messages.
        payload: what the function gets; it travels to the machine that runs it.
    """

    name: str
    payload: P


@dataclass(frozen=True)
class Failed:
    """A task that came to nothing.

    Attributes:
        reason: in one line.
    """

    reason: str


class WrongVersion(ConfigError):
    """Raised on a machine that has another version of the package."""


def run_tasks(
    ray: Any,
    function: Callable[[P], R],
    tasks: Iterable[Task[P]],
    retries: int = RETRIES,
) -> Iterator[tuple[Task[P], R | Failed]]:
    """Runs a function on each payload, one core for each, and yields results as they come.

    A task whose process or machine died runs again elsewhere. One that raises an error does not:
    it would raise it again.

    Args:
        ray: from :func:`fish_env.cluster.connected`.
        function: of a module that each machine can import. The same payload must give the same
            result. It runs on one thread.
        tasks: read one after the other, as cores get free.
        retries: how often a task is started again.

    Yields:
        A task with its result, in the order in which they end.

    Raises:
        WrongVersion: a machine has another version of this package.
        ConfigError: the cluster is gone.
    """
    remote = ray.remote(_one).options(
        num_cpus=1, max_retries=retries, retry_exceptions=False, scheduling_strategy="SPREAD"
    )
    shared = ray.put(function)
    waiting = iter(tasks)
    running: dict[Any, Task[P]] = {}
    left = True
    try:
        while left or running:
            room = AHEAD * _cores(ray) - len(running)
            while left and room > 0:
                task = next(waiting, None)
                left, room = task is not None, room - 1
                if task is not None:
                    running[remote.remote(shared, task.payload, VERSION)] = task
            ended, _ = ray.wait(list(running), timeout=LOOK_EVERY_S) if running else ([], [])
            for reference in ended:
                yield running.pop(reference), _result(ray, reference)
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _cores(ray: Any) -> int:
    try:
        return max(1, int(ray.cluster_resources().get("CPU", 1)))
    except Exception as error:  # of Ray or of its transport; the head no longer answers
        raise ConfigError(
            f"the cluster no longer answers ({type(error).__name__}); what is done is kept, run "
            "the same command again to continue"
        ) from error


def _result(ray: Any, reference: Any) -> Any:
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        cause = error.cause
        if isinstance(cause, WrongVersion):
            raise cause from None
        return Failed(_line(cause))
    except ray.exceptions.RayError as error:
        return Failed(f"its process or machine died each time ({type(error).__name__})")


def _line(error: BaseException) -> str:
    words = " ".join(str(error).split())
    return words if isinstance(error, RoboticFishError) else f"{type(error).__name__}: {words}"


def check_version(version: str) -> None:
    """Refuses to work with another version of the package than the machine that asks.

    Args:
        version: of the machine that asks.

    Raises:
        WrongVersion: this machine has another.
    """
    if version != VERSION:
        raise WrongVersion(
            f"{socket.gethostname()} has robotic-fish {VERSION}, the command {version}; "
            "results would differ. Install the same version on all machines"
        )


def _one(function: Callable[[Any], Any], payload: Any, version: str) -> Any:
    """What runs in a worker: the function, on one thread, in the right version."""
    check_version(version)
    os.environ["ROBOFISH_THREADS"] = "1"
    return function(payload)
