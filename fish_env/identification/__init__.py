"""Identification: what values of the parameters explain measured runs, and how surely.

Usable on its own: build a :class:`SeriesProblem`, call :func:`fit`, read the :class:`Fit`, turn it
into a fish with :func:`identified_fish`.
"""

from fish_env.identification.series import SeriesProblem
from fish_env.identification.starts import likely_start
from fish_env.identification.writing import identified_fish
from fish_env.inference.estimate.fit import Fit, fit

__all__ = ["Fit", "SeriesProblem", "fit", "identified_fish", "likely_start"]
