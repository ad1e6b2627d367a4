"""Diagnosis: what a simulation gets wrong, from measured runs to a named cause.

:func:`diagnose` takes a folder and returns the answer as plain data; :func:`diagnose_runs` keeps
the fits and screens for a closer look.
"""

from fish_env.diagnosis.pipeline import diagnose, diagnose_runs
from fish_env.diagnosis.result import Diagnosis

__all__ = ["Diagnosis", "diagnose", "diagnose_runs"]
