"""Diagnosis of tables of steady motion: averages under held commands instead of runs over time."""
