"""Catalogue of effects that the baseline model leaves out: one file each.

A new effect is one new file here with an ``EFFECT`` of its own; nothing else changes.
"""

from fish_env.effects.registry import catalogue, get_effect, load_effect_file

__all__ = ["catalogue", "get_effect", "load_effect_file"]
