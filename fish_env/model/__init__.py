"""Compiled physics: one force, one function; composed into kernels by :mod:`fish_env.model.compose`."""
