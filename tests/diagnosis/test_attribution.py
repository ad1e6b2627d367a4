"""When two explanations are rivals, and when both are needed."""

from types import SimpleNamespace

import pytest

from fish_env.effects import catalogue
from fish_env.inference import attribution
from fish_env.inference.attribution import explained_away, shortlisted


def screen_of(**statistics):
    signals = [SimpleNamespace(cause=SimpleNamespace(name=n), statistic=s)
               for n, s in statistics.items()]  # fmt: skip
    return SimpleNamespace(best=lambda: signals)


def test_a_rival_loses_its_evidence_to_the_accepted_cause():
    before = screen_of(current=900.0, tether=400.0, gyro_bias=80.0)
    after = screen_of(tether=3.0, gyro_bias=75.0)
    assert explained_away("tether", before, after)
    assert not explained_away("gyro_bias", before, after)


def test_a_cause_with_nothing_left_is_explained_away():
    assert explained_away("wave", screen_of(wave=50.0), screen_of())


def test_coefficients_after_the_first_are_judged_among_themselves():
    signals = [
        SimpleNamespace(
            cause=SimpleNamespace(name=f"parameter:{i}", is_effect=False),
            log_p=p,
            statistic=20.0,
        )
        for i, p in enumerate([-7.0, -5.5, -5.0, *[-1.0] * 37])
    ]
    screen = SimpleNamespace(signals=signals, best=lambda: signals, threshold=-7.6, level=0.05)
    problem = SimpleNamespace(known={})
    names = [
        [s.cause.name for s in shortlisted(problem, screen, 4, found=found)] for found in (0, 1, 5)
    ]
    assert names[0] == []
    assert names[1] == ["parameter:0"]  # 2 / 41 of the level: -6.0
    assert names[2] == ["parameter:0", "parameter:1"]  # 6 / 45 of it: -5.0


def test_what_looks_like_the_first_is_always_tried():
    names = ["servo_lag", "tether", "wave", "current", "tail_flexibility"]
    signals = [
        SimpleNamespace(
            cause=SimpleNamespace(name=n, is_effect=True), log_p=-100.0 + i, statistic=90.0
        )
        for i, n in enumerate(names)
    ]
    problem = SimpleNamespace(known=catalogue())
    assert "tail_flexibility" in catalogue()["servo_lag"].confusable_with
    screen = SimpleNamespace(best=lambda: signals, threshold=-50.0)
    tried = [s.cause.name for s in shortlisted(problem, screen, 2)]
    assert tried == ["servo_lag", "tether", "tail_flexibility"]
    nothing = SimpleNamespace(best=lambda: signals, threshold=-200.0)
    assert shortlisted(problem, nothing, 2) == []
    assert shortlisted(problem, screen, 2, least=100.0) == []  # within the simulation's own error


def settled(best, other):
    return other.score < 6.0


def drowned(best, other):
    return other.score < 600.0


@pytest.mark.parametrize(("gap", "steps"), [(3.0, 1), (300.0, 2), (3000.0, 2)])
def test_a_tie_ends_the_search_but_not_a_difference_that_a_misfit_drowns(monkeypatch, gap, steps):
    """Two causes that look alike while a third is missing are judged when it is there."""
    problem = SimpleNamespace(known={}, subset=None, interchangeable=(), variations=())
    screens = SimpleNamespace(best=lambda: [])
    done = []

    def explanation(causes, gap=0.0):
        fit = SimpleNamespace(problem=problem, effects=(), released=(), point=None)
        return SimpleNamespace(causes=causes, fit=fit, score=gap)

    def refits(current, *arguments):
        done.append(current.causes)
        if len(current.causes) == 2:
            return [], None
        best = explanation((*current.causes, "abc"[len(current.causes)]))
        other = explanation((*current.causes, "x"), gap if not current.causes else 1e9)
        return [best, other], explanation(current.causes, 1e6)

    nothing = explanation((), 1e6)
    for name, value in {
        "refits": refits, "screen": lambda *a: screens,
        "tied": settled, "alike": drowned, "explained_away": lambda *a: True,
        "shortlisted": lambda *a: [], "implausible_estimates": lambda fit: (),
        "ranking_of": lambda *a: (),
        "backward_elimination": lambda e: e, "swap_step": lambda e, *a: [e],
        "_under_relaxed_noise": lambda *a: None, "finished": lambda fit: fit,
    }.items():  # fmt: skip
        monkeypatch.setattr(attribution, name, value)
    begun = attribution.Attribution(nothing, (screens,), nothing, (), (), 0.0)
    found = attribution.extended(begun, (), None)
    assert len(found.accepted.causes) == steps
    assert len(found.rivals) == (1 if steps == 1 else 0)


def effect_signal(name, uncorrected):
    return SimpleNamespace(
        cause=SimpleNamespace(name=name, is_effect=True),
        uncorrected=uncorrected,
        log_p=-uncorrected,
    )


def test_what_puts_a_beat_out_of_step_is_tried_whatever_the_screen_makes_of_it(monkeypatch):
    strong = [effect_signal(name, 1000.0) for name in ("sensor_delay", "block_lag", "added_mass")]
    weak = [effect_signal(name, 1.0) for name in ("clock_scale", "battery_sag", "tether")]
    shown = SimpleNamespace(best=lambda: [*weak, *strong])
    loose = SimpleNamespace()
    for name, value in {
        "disturbance_at_limit": lambda fit: ("a push",),
        "screen": lambda *a: shown,
    }.items():  # fmt: skip
        monkeypatch.setattr(attribution, name, value)
    fit = SimpleNamespace(problem=SimpleNamespace(out_of_step=("clock_scale", "battery_sag")))
    nothing = SimpleNamespace(causes=(), fit=fit, with_relaxed_noise=loose)
    found, tried = attribution._under_relaxed_noise(nothing, strong, (), None)
    assert found is loose
    names = [s.cause.name for s in tried]
    assert names == ["sensor_delay", "block_lag", "added_mass", "clock_scale", "battery_sag"]


def test_relatives_of_an_accepted_cause_are_tried_along_with_what_shows_next(monkeypatch):
    """Two delays in a row are nearly one: the second shows no more, and what shows is its echo."""
    echo, twin, other = (effect_signal(n, 50.0) for n in ("block_lag", "sensor_delay", "tether"))
    screens = SimpleNamespace(best=lambda: [echo, twin, other])
    asked = []

    def refits(current, chosen, report, loose, effort, like, unseen):
        asked.append([s.cause.name for s in (*chosen, *unseen)])
        return [], None

    monkeypatch.setattr(attribution, "refits", refits)
    monkeypatch.setattr(attribution, "_under_relaxed_noise", lambda *a: None)
    monkeypatch.setattr(attribution, "finished", lambda fit: fit)
    fit = SimpleNamespace(
        problem=SimpleNamespace(known=catalogue()), released=(), effects=("servo_delay",)
    )
    accepted = SimpleNamespace(causes=("servo_delay",), fit=fit, score=0.0)
    begun = attribution.Attribution(accepted, (screens,), accepted, (), (), 0.0)
    monkeypatch.setattr(attribution, "backward_elimination", lambda e: e)
    for shown, expected in (([echo], ["block_lag", "sensor_delay"]), ([], [])):
        monkeypatch.setattr(attribution, "shortlisted", lambda *a, shown=shown: [*shown])
        attribution.extended(begun, (), None)
        assert asked.pop() == expected
