"""Work on many cores and machines, by Ray: an embedded cluster, or one that runs already.

Nothing here knows of fish. Ray is imported when a cluster is used, and belongs to the extra `ray`.
"""

from fish_env.cluster.session import ClusterSettings, connected
from fish_env.cluster.tasks import Failed, Task, check_version, run_tasks

__all__ = ["ClusterSettings", "Failed", "Task", "check_version", "connected", "run_tasks"]
