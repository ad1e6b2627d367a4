"""Checks of what a diagnosis is given, before any force model is fitted."""
