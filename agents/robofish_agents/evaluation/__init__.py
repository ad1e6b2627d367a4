"""Frozen sets of episodes, their metrics, and confidence intervals."""
