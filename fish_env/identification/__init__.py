"""Identification: what values of the parameters explain measured runs, and how surely.

Usable on its own: build a :class:`Problem`, call :func:`fit`, read the :class:`Fit`, turn it into
a fish with :func:`identified_fish`.
"""

from fish_env.identification.estimator import Fit, fit
from fish_env.identification.problem import Problem
from fish_env.identification.starts import likely_start
from fish_env.identification.writing import identified_fish

__all__ = ["Fit", "Problem", "fit", "identified_fish", "likely_start"]
