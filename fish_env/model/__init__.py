"""Compiled physics: one force, one function; :mod:`fish_env.model.compose` joins them."""
