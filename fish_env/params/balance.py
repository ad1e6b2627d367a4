"""Mass and inertia of the whole fish with the weight block at rest, from its parts.

The formulas are those of the model's mass properties, evaluated once for checking a parameter set.
"""

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.params.fish_data import FishData


def central_inertia(fish: FishData) -> FloatArray:
    """Returns the inertia about the centre of mass C_m, body frame, kg m^2, shape (3, 3).

    J - m_total (|C_m|^2 I - C_m C_m^T), with J diagonal about O_b as the model has it. The 6 x 6
    mass matrix of the Newton-Euler equations is positive definite exactly when this is.
    """
    centre = centre_of_mass(fish)
    shift = fish.mass.total * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.asarray(np.diag(inertia_about_origin(fish)) - shift)


def centre_of_mass(fish: FishData) -> FloatArray:
    """Returns the centre of mass C_m = (M_ew + m_w C_w) / m_total, body frame, m, shape (3,)."""
    rest = np.asarray(fish.mass.static_moment_rest)
    return np.asarray((rest + fish.mass.weight_block * block_centre(fish)) / fish.mass.total)


def block_centre(fish: FishData) -> FloatArray:
    """Returns the block's centre of mass C_w at rest, body frame, m, shape (3,)."""
    block = fish.weight_block
    offset = (block.d1 - block.s_w0 + block.d3, 0.0, block.d2)
    return np.asarray(np.asarray(block.bracket_origin) + offset)


def inertia_about_origin(fish: FishData) -> FloatArray:
    """Returns the moments of inertia J about O_b, kg m^2, shape (3,)."""
    block_mass = fish.mass.weight_block
    rest_mass = fish.mass.total - block_mass
    rest_centre = np.asarray(fish.mass.static_moment_rest) / rest_mass
    own = np.asarray(fish.inertia.rest) + np.asarray(fish.inertia.weight_block)
    rest_moved = rest_mass * axis_distances(rest_centre)
    return np.asarray(own + rest_moved + block_mass * axis_distances(block_centre(fish)))


def axis_distances(centre: FloatArray) -> FloatArray:
    """Returns the squared distance of a point from each axis, m^2, shape (3,)."""
    squares = centre**2
    return np.asarray(squares.sum() - squares)
