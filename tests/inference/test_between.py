"""Lags are screened at sizes between small and large: a run's own phase hides some of them."""

import numpy as np

from fish_env.inference.estimate.fit import fit
from fish_env.inference.probes import causes_of
from fish_env.inference.screening import screen
from tests.inference.stated import Stated, effect, size_of

RUNS, SAMPLES, LAG = 4, 200, "lag"


def problem():
    """Runs in which an effect does something at a middle size, and other things at either end."""
    rng = np.random.default_rng(0)
    noise, *courses = rng.standard_normal((4, RUNS, SAMPLES))
    ends = (0.1, 0.35, 0.6)  # small, between, and large

    def residuals(z, effects):
        size = effects[size_of(LAG)]
        near = [max(1.0 - abs(size - end) / 0.1, 0.0) for end in ends]
        change = sum(share * course for share, course in zip(near, courses, strict=True))
        return noise + courses[1] - change + z[0]

    return Stated(residuals, [effect(LAG)])


def shown(stated):
    own = fit(stated, refit_noise=False)
    return screen(own, causes_of(stated), np.random.default_rng(0)).best()[0].log_p


def test_a_lag_of_a_middle_size_shows():
    stated = problem()
    stated.hidden_by_drive = (LAG,)
    assert shown(stated) < -50.0


def test_sizes_between_are_those_of_lags_alone():
    assert shown(problem()) > -10.0
