"""A cluster of several nodes on this machine, one of which can be killed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import ray
from ray.cluster_utils import Cluster

from fish_env.cluster import ClusterSettings

NODE = {"object_store_memory": 100_000_000, "include_dashboard": False}


class Machines:
    """A head without cores and two nodes with one core each."""

    def __init__(self) -> None:
        self._cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, **NODE})
        self._nodes = [self._cluster.add_node(num_cpus=1, **NODE) for _ in range(2)]
        self._cluster.wait_for_nodes()

    @property
    def settings(self) -> ClusterSettings:
        return ClusterSettings(address=self._cluster.address)

    @property
    def alive(self) -> int:
        """Nodes with a core that the cluster counts as alive."""
        return sum(bool(n["Alive"] and n["Resources"].get("CPU")) for n in ray.nodes())

    def kill_one(self) -> None:
        """Kills a node at once, with everything that runs on it."""
        self._cluster.remove_node(self._nodes.pop(), allow_graceful=False)

    def close(self) -> None:
        ray.shutdown()
        self._cluster.shutdown()


@contextmanager
def machines() -> Iterator[Machines]:
    made = Machines()
    try:
        yield made
    finally:
        made.close()


class KillOnce:
    """Kills a node when it is called for the first time."""

    def __init__(self, cluster: Machines) -> None:
        self.cluster, self.calls = cluster, 0

    def __call__(self, *_: Any) -> None:
        self.calls += 1
        if self.calls == 1:
            self.cluster.kill_one()
