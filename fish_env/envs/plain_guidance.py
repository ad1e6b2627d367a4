"""The geometry of :mod:`fish_env.envs.guidance` as plain functions of numbers, not compiled.

For what steers a fish outside the environment, and for tests.
"""

from __future__ import annotations

from fish_env.envs import guidance
from fish_env.model.jit import py_function

on_leg = py_function(guidance.on_leg)
steer = py_function(guidance.steer)
leg_of = py_function(guidance.leg_of)
corner = py_function(guidance.corner)
drift_rate = py_function(guidance.drift_rate)
