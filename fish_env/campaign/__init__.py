"""Many data sets diagnosed on a cluster, into a folder that can be gone on with."""

from fish_env.campaign.cases import Case, Options, find_cases
from fish_env.campaign.run import Row, run_campaign

__all__ = ["Case", "Options", "Row", "find_cases", "run_campaign"]
