"""Frozen sets of episodes, what is measured on them, and how sure the numbers are."""
