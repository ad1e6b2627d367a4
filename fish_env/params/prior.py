"""From the relative priors of a parameter file to standard deviations and covariances."""

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.params.fields import Leaf
from fish_env.params.fish_data import FishData

# A fish is trimmed in the water with weights of a fraction of a gram, so buoyancy minus mass is
# known far better than either of the two.
TRIM_SD_KG = 0.0002
STATIC_MOMENT_ARM_M = 0.1


def standard_deviation(fish: FishData, leaf: Leaf) -> float:
    """Returns the prior standard deviation of one number in its own unit.

    For the buoyancy it is that of the trim, given the mass.
    """
    group = leaf.spec.prior
    if group is None:
        return 0.0
    if group == "trim":
        return TRIM_SD_KG
    if group == "static_moment":
        return fish.prior.geometry * fish.mass.total * STATIC_MOMENT_ARM_M
    relative: float = getattr(fish.prior, group)
    return relative * abs(float(leaf.value))


def covariance(fish: FishData, chosen: list[Leaf]) -> FloatArray:
    """Returns the prior covariance of several numbers, shape (n, n).

    The buoyancy is the mass plus an independent trim: it has the variance of both, and the mass's
    variance as covariance with the mass.
    """
    matrix = np.diag([standard_deviation(fish, leaf) ** 2 for leaf in chosen])
    mass_variance = (fish.prior.mass * fish.mass.total) ** 2
    rows = {leaf.path: index for index, leaf in enumerate(chosen)}
    buoyancy, total = rows.get("mass.buoyancy"), rows.get("mass.total")
    if buoyancy is not None:
        matrix[buoyancy, buoyancy] += mass_variance
    if buoyancy is not None and total is not None:
        matrix[buoyancy, total] = matrix[total, buoyancy] = mass_variance
    return matrix
