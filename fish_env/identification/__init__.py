"""Identification: what values of the parameters explain measured runs, and how surely.

Usable on its own: build a :class:`Problem`, call :func:`fit`, read the :class:`Fit`.
"""

from fish_env.identification.estimator import Fit, fit
from fish_env.identification.problem import Problem

__all__ = ["Fit", "Problem", "fit"]
