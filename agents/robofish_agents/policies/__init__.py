"""Trained policies: their files, their forward pass in NumPy, and those that are shipped."""

from robofish_agents.policies.files import PolicyFile, read_policy, write_policy
from robofish_agents.policies.history import History, HistorySpec
from robofish_agents.policies.network import Network
from robofish_agents.policies.pretrained import PretrainedPolicy, shipped

__all__ = [
    "History",
    "HistorySpec",
    "Network",
    "PolicyFile",
    "PretrainedPolicy",
    "read_policy",
    "shipped",
    "write_policy",
]
