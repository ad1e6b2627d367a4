"""Random numbers of the device, each a function of seed, fish, episode, and a count.

Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011). No state is
kept, so that any number can be drawn by any thread at any time, and a run can be repeated.
"""

from __future__ import annotations

import math

import numpy as np

_MASK = np.uint64(0xFFFFFFFF)
_WORD = np.uint64(32)
_EIGHT = np.uint64(8)
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)
_ROUNDS = 10
_STEP = 2.0**-24


def philox(c0, c1, c2, c3, k0, k1):
    """Four random words (uint64 below 2**32) of a counter of four words and a key of two."""
    for _ in range(_ROUNDS):
        first = _MULTIPLIER_0 * c0
        second = _MULTIPLIER_1 * c2
        c0 = (second >> _WORD) ^ c1 ^ k0
        c1 = second & _MASK
        c2 = (first >> _WORD) ^ c3 ^ k1
        c3 = first & _MASK
        k0 = (k0 + _WEYL_0) & _MASK
        k1 = (k1 + _WEYL_1) & _MASK
    return c0, c1, c2, c3


def unit(word):
    """A number in [0, 1) from a word: a whole multiple of 2**-24, exact in float32 too."""
    return np.float64(word >> _EIGHT) * _STEP


def normals(first, second):
    """Two independent standard normal numbers from two words (Box and Muller)."""
    radius = math.sqrt(-2.0 * math.log(unit(first) + 0.5 * _STEP))
    angle = 6.283185307179586 * unit(second)
    return radius * math.cos(angle), radius * math.sin(angle)


def normal_quantile(p):
    """The standard normal quantile of p in 1e-10..1 - 1e-10.

    Wichura's algorithm AS 241 (PPND16), Applied Statistics 37, 1988.
    """
    q = p - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        over = (((((((2509.0809287301226727 * r + 33430.575583588128105) * r
            + 67265.770927008700853) * r + 45921.953931549871457) * r
            + 13731.693765509461125) * r + 1971.5909503065514427) * r
            + 133.14166789178437745) * r + 3.387132872796366608)  # fmt: skip
        under = (((((((5226.495278852545925 * r + 28729.085735721942674) * r
            + 39307.89580009271061) * r + 21213.794301586595867) * r
            + 5394.1960214247511077) * r + 687.1870074920579083) * r
            + 42.313330701600911252) * r + 1.0)  # fmt: skip
        return q * over / under
    r = math.sqrt(-math.log(p if q < 0.0 else 1.0 - p)) - 1.6
    over = (((((((7.7454501427834140764e-4 * r + 0.0227238449892691845833) * r
        + 0.24178072517745061177) * r + 1.27045825245236838258) * r
        + 3.64784832476320460504) * r + 5.7694972214606914055) * r
        + 4.6303378461565452959) * r + 1.42343711074968357734)  # fmt: skip
    under = (((((((1.05075007164441684324e-9 * r + 5.475938084995344946e-4) * r
        + 0.0151986665636164571966) * r + 0.14810397642748007459) * r
        + 0.68976733498510000455) * r + 1.6763848301838038494) * r
        + 2.05319162663775882187) * r + 1.0)  # fmt: skip
    value = over / under
    return -value if q < 0.0 else value
