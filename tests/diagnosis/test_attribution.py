"""When two explanations are rivals, and when both are needed."""

from types import SimpleNamespace

from fish_env.effects import catalogue
from fish_env.inference import attribution
from fish_env.inference.rivals import explained_away
from fish_env.inference.shortlist import shortlisted
from fish_env.inference.vehicle import Drive


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
    problem = SimpleNamespace(out_of_step=("clock_scale", "battery_sag"), drive=Drive())
    nothing = SimpleNamespace(
        causes=(), fit=SimpleNamespace(problem=problem), with_relaxed_noise=loose
    )
    found, tried = attribution._under_relaxed_noise(nothing, strong, (), None)
    assert found is loose
    names = [s.cause.name for s in tried]
    assert names == ["sensor_delay", "block_lag", "added_mass", "clock_scale", "battery_sag"]
    problem.drive = Drive(known=True)
    assert attribution._under_relaxed_noise(nothing, strong, (), None) is None
