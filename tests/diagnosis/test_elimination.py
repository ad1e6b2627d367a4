"""A cause that others make needless, or that may as well not act, is dropped."""

from types import SimpleNamespace

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.inference import elimination
from fish_env.inference.elimination import backward_elimination, may_not_act


def fit_of(effect, values, sd, correlation=0.0):
    names = [f"effects.{effect}.{p.name}" for p in catalogue()[effect].parameters]
    count = len(names)
    covariance = np.outer(sd, sd) * (np.eye(count) * (1 - correlation) + correlation)
    return SimpleNamespace(
        problem=SimpleNamespace(known=catalogue()), effects=(effect,), names=tuple(names),
        estimates=np.array(values), covariance=covariance,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("fit", "idle"),
    [
        (fit_of("block_scale", [0.989], [0.0148]), True),
        (fit_of("block_scale", [0.95], [0.0148]), False),
        (fit_of("current", [0.02, 0.0, 0.0], [0.005, 0.005, 0.005]), False),
        (fit_of("current", [0.008, 0.0, 0.0], [0.005, 0.005, 0.005]), True),
        (fit_of("current", [0.007, 0.007, -0.007], [0.005] * 3, 0.0), True),
        (fit_of("current", [0.007, -0.007, 0.0], [0.005] * 3, 0.9), False),
        (fit_of("servo_rate_limit", [6.0], [9.0]), False),
        (fit_of("wave", [1e-3, 0.4, 1.0, 2.0, 1.5], [1e-3, 1e-6, 1e-6, 1e-6, 1e-6]), True),
    ],
    ids=["scale", "far", "current", "weak", "all weak", "together", "infinite", "shapes"],
)
def test_a_region_that_holds_its_absence_shows_nothing(fit, idle):
    """All that switches a cause on counts together; where and when it acts does not."""
    assert may_not_act(fit, fit.effects[0]) is idle


def test_a_coefficient_is_off_at_its_nominal_value():
    baseline = SimpleNamespace(mean=np.array([0.0, 2.0]), paths=("tail.area", "mass.total"))
    fit = SimpleNamespace(
        problem=SimpleNamespace(baseline=baseline), effects=(), names=baseline.paths,
        estimates=np.array([0.0, 2.1]), covariance=np.diag([1.0, 0.04**2]),
    )  # fmt: skip
    assert not may_not_act(fit, "parameter:mass.total")
    fit.covariance[1, 1] = 0.06**2
    assert may_not_act(fit, "parameter:mass.total")


@pytest.mark.parametrize(("value", "kept"), [(0.989, ("current",)), (0.9, ("current", "scale"))])
def test_an_idle_cause_is_dropped_whatever_its_evidence(monkeypatch, value, kept):
    smaller = SimpleNamespace(causes=("current",), score=50.0, fit=0.0)
    both = SimpleNamespace(causes=("current", "scale"), score=0.0, fit=value)
    monkeypatch.setattr(
        elimination, "without", lambda e, names: smaller if "scale" in names else None
    )
    monkeypatch.setattr(elimination, "may_not_act", lambda fit, name: fit > 0.95)
    monkeypatch.setattr(elimination, "surely_acts", lambda fit, name: False)
    assert backward_elimination(both).causes == kept
