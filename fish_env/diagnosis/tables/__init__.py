"""Diagnosis of tables of steady motion: what differs from that of runs over time."""
