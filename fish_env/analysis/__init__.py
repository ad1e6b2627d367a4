"""Comparing, fitting and diagnosing in a notebook: data in, results that show themselves out.

The same as the commands of these names: `fish_env.compare`, `fish_env.fit`, `fish_env.diagnose`.
"""

from fish_env.analysis.calls import compare, diagnose, fit
from fish_env.analysis.results import CompareResult, DiagnoseResult, FitResult, Pictures

__all__ = [
    "CompareResult",
    "DiagnoseResult",
    "FitResult",
    "Pictures",
    "compare",
    "diagnose",
    "fit",
]
