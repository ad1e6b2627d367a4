"""Whole runs as a problem: simulation errors from the start of each run to its end."""
