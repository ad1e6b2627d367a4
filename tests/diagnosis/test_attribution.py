"""When two explanations are rivals, and when both are needed."""

import numpy as np
import pytest
from scipy.special import chdtri

from fish_env.effects import catalogue
from fish_env.inference.attribution import attribute
from fish_env.inference.estimate.fit import fit
from fish_env.inference.hypotheses import Coefficient
from fish_env.inference.probes import Cause, causes_of
from fish_env.inference.rivals import explained_away
from fish_env.inference.screening import Screen
from fish_env.inference.shortlist import shortlisted
from fish_env.inference.vehicle import Drive
from tests.inference.stated import Stated, White, apart, effect, signal_of


def screen_of(statistics, threshold=-7.6):
    signals = [signal_of(Cause(name), statistic) for name, statistic in statistics.items()]
    return Screen(tuple(signals), threshold, 0.05)


def test_a_rival_loses_its_evidence_to_the_accepted_cause():
    before = screen_of({"current": 900.0, "tether": 400.0, "gyro_bias": 80.0})
    after = screen_of({"tether": 3.0, "gyro_bias": 75.0})
    assert explained_away("tether", before, after)
    assert not explained_away("gyro_bias", before, after)


def test_a_cause_with_nothing_left_is_explained_away():
    assert explained_away("wave", screen_of({"wave": 50.0}), screen_of({}))


def nothing_missing(*known):
    return Stated(lambda z, effects: np.zeros((1, 1)), known)


def test_coefficients_after_the_first_are_judged_among_themselves():
    paths = [str(i) for i in range(40)]
    statistics = chdtri(1, np.exp([-7.0, -5.5, -5.0, *[-1.0] * 37]))
    causes = [Cause(Coefficient(path)) for path in paths]
    signals = tuple(signal_of(c, s) for c, s in zip(causes, statistics.tolist(), strict=True))
    screen = Screen(signals, -7.6, 0.05)
    names = [
        [s.cause.id for s in shortlisted(nothing_missing(), screen, 4, found=found)]
        for found in (0, 1, 5)
    ]
    assert names[0] == []
    assert names[1] == [Coefficient("0")]  # 2 / 41 of the level: -6.0
    assert names[2] == [Coefficient("0"), Coefficient("1")]  # 6 / 45 of it: -5.0


def test_what_looks_like_the_first_is_always_tried():
    names = ("servo_lag", "tether", "wave", "current", "tail_flexibility")
    problem = nothing_missing(catalogue()["servo_lag"])
    statistics = {name: 90.0 - i for i, name in enumerate(names)}
    screen = screen_of(statistics, threshold=-20.0)
    tried = [s.cause.id for s in shortlisted(problem, screen, 2)]
    assert tried == ["servo_lag", "tether", "tail_flexibility"]
    assert shortlisted(problem, screen_of(statistics, threshold=-200.0), 2) == []


STRONG = ("sensor_delay", "block_lag", "added_mass")
DRIFTING = ("clock_scale", "battery_sag")


class Driven(Stated):
    """A problem with a periodic drive, which relaxed noise follows."""

    out_of_step = DRIFTING

    def relaxed_noise(self, noise):
        return White(relaxed=True)


@pytest.mark.parametrize("in_step", [False, True])
def test_what_puts_a_beat_out_of_step_is_tried_whatever_the_screen_makes_of_it(in_step):
    sizes = {**dict.fromkeys(STRONG, 20.0), **dict.fromkeys(DRIFTING, 0.5), "tether": 0.8}
    targets = {name: np.full(4, size) for name, size in sizes.items()}
    problem = Driven(apart(targets), [effect(name) for name in targets], limit=1.0)
    problem.drive = Drive(known=in_step)
    said = []
    rng = np.random.default_rng(0)
    attribute(fit(problem), causes_of(problem), rng, report=said.append)
    relaxed = [step.split()[1] for step in said if step.endswith("under relaxed noise")]
    assert sorted(relaxed) == ([] if in_step else sorted((*STRONG, *DRIFTING)))
