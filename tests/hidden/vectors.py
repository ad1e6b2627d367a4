"""Vectors as tuples of three, rotations as nine numbers in a state, and a 6 x 6 solver."""

from __future__ import annotations

import math

from tests.hidden.jit import helper


@helper
def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@helper
def scale(k, a):
    return k * a[0], k * a[1], k * a[2]


@helper
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@helper
def to_inertial(y, a):
    """R a, R in the state, row by row from index 3."""
    return (
        y[3] * a[0] + y[4] * a[1] + y[5] * a[2],
        y[6] * a[0] + y[7] * a[1] + y[8] * a[2],
        y[9] * a[0] + y[10] * a[1] + y[11] * a[2],
    )


@helper
def to_body(y, a):
    """R^T a."""
    return (
        y[3] * a[0] + y[6] * a[1] + y[9] * a[2],
        y[4] * a[0] + y[7] * a[1] + y[10] * a[2],
        y[5] * a[0] + y[8] * a[1] + y[11] * a[2],
    )


@helper
def orthonormalise(y):
    """Gram-Schmidt on the rows of R."""
    norm = math.sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2)
    first = (y[3] / norm, y[4] / norm, y[5] / norm)
    second = (y[6], y[7], y[8])
    second = add(second, scale(-dot(first, second), first))
    second = scale(1.0 / math.sqrt(dot(second, second)), second)
    third = cross(first, second)
    for i in range(3):
        y[3 + i], y[6 + i], y[9 + i] = first[i], second[i], third[i]


@helper
def add_element(matrix, mass, force_part, moment_part):
    """matrix += mass g g^T with g = (force_part, moment_part)."""
    g = (
        force_part[0],
        force_part[1],
        force_part[2],
        moment_part[0],
        moment_part[1],
        moment_part[2],
    )
    for i in range(6):
        for j in range(6):
            matrix[i, j] += mass * g[i] * g[j]


@helper
def solve6(matrix, right):
    """Gaussian elimination with pivoting, in place; the solution replaces `right`."""
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, 6):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        for i in range(k + 1, 6):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
