"""Catalogue of effects that the baseline model leaves out: one file each.

To add an effect, add a file with an ``EFFECT`` here. No other file changes.
"""

from fish_env.effects.registry import catalogue, get_effect, load_effect_file

__all__ = ["catalogue", "get_effect", "load_effect_file"]
