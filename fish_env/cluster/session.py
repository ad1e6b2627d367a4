"""Starting an embedded Ray, or joining a cluster, and leaving it again."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fish_env.errors import ConfigError, missing_extra
from fish_env.threads import default_threads

OBJECT_STORE_BYTES = 100_000_000
"""Shared memory of the embedded Ray. Ray's own default is 30 % of the machine's memory."""
ANSWER_S = 5.0
"""How long the head of a cluster may take to accept a connection."""
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # Ray would report to its makers
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_AIR_NEW_OUTPUT": "0",
}
"""Settings of Ray, unless the user sets them otherwise."""


@dataclass(frozen=True)
class ClusterSettings:
    """Where work is done.

    Attributes:
        address: of a running cluster, ``host:port`` or ``auto``; None starts one on this machine
            that ends with the work.
        cpus: tasks side by side on this machine; default: its cores. Not with an address.
        temp: folder for Ray's own files on this machine; default: Ray's, among the temporary ones.
            Not with an address.
    """

    address: str | None = None
    cpus: int | None = None
    temp: Path | None = None

    def __post_init__(self) -> None:
        """Refuses what contradicts itself.

        Raises:
            ConfigError: says which.
        """
        if self.address is not None and (self.cpus is not None or self.temp is not None):
            raise ConfigError(
                "--address: --cpus and --temp apply only to a cluster on this machine; "
                "leave them out"
            )
        if self.cpus is not None and self.cpus < 1:
            raise ConfigError(f"--cpus {self.cpus}: at least 1")


@contextmanager
def connected(settings: ClusterSettings) -> Iterator[Any]:
    """Yields the module `ray`, connected to a cluster; leaves it at the end, whatever happens.

    A process that is connected already keeps its connection.

    Args:
        settings: which cluster.

    Raises:
        MissingExtraError: Ray is not installed.
        ConfigError: there is no cluster at the address, or none can be started.
    """
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    try:
        import ray
    except ImportError as error:
        raise missing_extra("Work on several cores or machines", "ray", "ray") from error
    if ray.is_initialized():
        yield ray
        return
    _start(ray, settings)
    try:
        yield ray
    finally:
        ray.shutdown()


def _start(ray: Any, settings: ClusterSettings) -> None:
    options: dict[str, Any] = {"logging_level": "error", "log_to_driver": False}
    if settings.address is None:
        options |= {
            "address": "local",
            "num_cpus": settings.cpus or default_threads(),
            "num_gpus": 0,
            "object_store_memory": OBJECT_STORE_BYTES,
            "include_dashboard": False,
        }
        if settings.temp is not None:
            options["_temp_dir"] = str(settings.temp.resolve())
    else:
        options["address"] = settings.address
        _knock(settings)
    try:
        ray.init(**options)
    # Ray raises many kinds of errors here, of its own, of gRPC and of Python.
    except Exception as error:
        ray.shutdown()
        raise _not_started(settings, error) from error


def _knock(settings: ClusterSettings) -> None:
    """Sees that something listens at the address; Ray itself would wait for many minutes."""
    host, colon, port = str(settings.address).rpartition(":")
    if not colon or not port.isdigit():
        return
    try:
        socket.create_connection((host.removeprefix("ray://"), int(port)), ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise _not_started(settings, error) from error


def _not_started(settings: ClusterSettings, error: Exception) -> ConfigError:
    reason = (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".")
    if settings.address is not None:
        return ConfigError(
            f"--address {settings.address}: no Ray cluster answers ({reason}); start one there "
            "with `ray start --head`, or leave the option out to use this machine"
        )
    if "AF_UNIX" in reason:
        return ConfigError(f"--temp {settings.temp}: the path is too long for Ray; shorten it")
    if "timed out" in reason:
        return ConfigError(
            f"Ray cannot start: this machine is too busy ({reason}); try again later"
        )
    return ConfigError(f"Ray cannot start on this machine ({reason}); give another --temp")
