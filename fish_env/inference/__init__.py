"""Inference from measurements, for any vehicle: estimate, search for causes, judge.

This package knows nothing of fish. A vehicle comes in as a :class:`~fish_env.inference.problem.
Problem`: its parameters with priors, its catalogue of effects, and whitened residuals for a batch
of parameter vectors.
"""
