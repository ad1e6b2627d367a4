"""Identification: what values of the parameters explain measured runs, and how surely.

:func:`fit_dataset` does all of it in one call. To go step by step, build a
:class:`SeriesProblem` or a :class:`WholeRunProblem`, call :func:`fit`, read the :class:`Fit`, and
turn one of a :class:`SeriesProblem` into a fish with :func:`identified_fish`.
"""

from fish_env.identification.dataset_fit import DatasetFit, Estimate, fit_dataset
from fish_env.identification.series import SeriesProblem
from fish_env.identification.starts import likely_start
from fish_env.identification.whole_runs.problem import WholeRunProblem
from fish_env.identification.writing import identified_fish
from fish_env.inference.estimate.fit import Fit, fit

__all__ = [
    "DatasetFit",
    "Estimate",
    "Fit",
    "SeriesProblem",
    "WholeRunProblem",
    "fit",
    "fit_dataset",
    "identified_fish",
    "likely_start",
]
