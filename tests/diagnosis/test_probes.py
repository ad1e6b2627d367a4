"""What is tried of each cause: inside physical bounds, never neutral, all that it can do."""

import numpy as np
import pytest

from fish_env.effects import catalogue
from fish_env.inference.around import finer
from fish_env.inference.probes import (
    Cause,
    each_alone,
    mirrored,
    of_visible,
    probes_of,
)
from fish_env.inference.starts import combined
from fish_env.model.effect import Effect, EffectParameter

EFFECTS = sorted(catalogue())


def faults(effect: Effect) -> list[str]:
    """What is wrong with the probes of an effect."""
    bounds = {p.name: (p.lower, p.upper) for p in effect.parameters}
    switches = {p.name for p in effect.switching}
    found = [] if probes_of(effect) else ["none"]
    for alternative in probes_of(effect):
        switched = {n for probe in alternative for n in switches
                    if probe[n] != effect.neutral[n]}  # fmt: skip
        if switched != switches:
            found.append(f"{alternative}: not every switch is probed")
        for probe in alternative:
            outside = [n for n, v in probe.items() if not bounds[n][0] <= v <= bounds[n][1]]
            found += [f"{name} outside its bounds" for name in outside]
            if set(probe) != set(effect.neutral):
                found.append("a parameter is missing")
    return found


@pytest.mark.parametrize("name", EFFECTS)
def test_probes_of_the_catalogue(name):
    assert faults(catalogue()[name]) == []


def test_parameters_of_shape_take_several_values():
    depths = {probe["depth"] for a in probes_of(catalogue()["surface_drag"]) for probe in a}
    assert len(depths) == 3


def test_a_direction_is_tried_all_around():
    """No wall is further than 30 degrees from one of them; both ends of a turn would be one."""
    tried = {probe["heading"] for a in probes_of(catalogue()["wall_effect"]) for probe in a}
    around = np.linspace(-np.pi, np.pi, 100)[:, None] - np.array(sorted(tried))
    assert np.cos(around).max(axis=1).min() > np.cos(np.pi / 6) - 1e-3
    assert len(tried) == 6


@pytest.mark.parametrize("frequency", [0.2, 0.361, 1.234, 2.0])
@pytest.mark.parametrize("phase", [-2.0, 0.0, 1.5])
def test_some_probe_shows_most_of_a_wave(frequency, phase):
    length = 30.0
    time = np.linspace(0.0, length, 1000)
    wave = np.sin(2 * np.pi * frequency * time + phase)
    shown = []
    for sine, cosine in probes_of(catalogue()["wave"], length=length):
        pair = [np.sin(2 * np.pi * p["frequency"] * time + p["phase"]) for p in (sine, cosine)]
        basis = np.linalg.qr(np.transpose(pair))[0]
        shown.append(((basis.T @ wave) ** 2).sum() / (wave**2).sum())
    assert max(shown) > 0.6


def test_sine_and_cosine_together_are_the_wave():
    effect = catalogue()["wave"]
    settings = probes_of(effect, length=10.0)[0]
    both = combined(effect, settings, (3.0, -4.0), effect.neutral)
    assert both["amplitude"] == pytest.approx(5.0 * settings[0]["amplitude"])
    time = np.linspace(0.0, 10.0, 50)
    turn = 2 * np.pi * both["frequency"] * time
    parts = (3.0 * np.sin(turn) - 4.0 * np.cos(turn)) * settings[0]["amplitude"]
    np.testing.assert_allclose(both["amplitude"] * np.sin(turn + both["phase"]), parts, atol=1e-12)


@pytest.mark.parametrize("seen", [0, 1], ids=["sine", "cosine"])
def test_half_a_wave_is_a_wave(seen):
    """The other half may change nothing of what is measured, and is then left out."""
    effect = catalogue()["wave"]
    setting = probes_of(effect, length=10.0)[0][seen]
    half = combined(effect, (setting,), (-3.0,), effect.neutral)
    both = [0.0, 0.0]
    both[seen] = -3.0
    whole = combined(effect, probes_of(effect, length=10.0)[0], both, effect.neutral)
    assert half == pytest.approx(whole)
    assert half["amplitude"] == pytest.approx(3.0 * setting["amplitude"])


def test_an_oscillation_is_looked_at_more_closely_and_nothing_else_is():
    effect = catalogue()["wave"]
    coarse = sorted({a[0]["frequency"] for a in probes_of(effect, length=30.0)})
    around = finer(effect, probes_of(effect, length=30.0)[5][0], 30.0)
    fine = sorted({a[0]["frequency"] for a in around})
    assert max(np.diff(fine)) < 0.11 / 30.0
    assert fine[0] <= coarse[4] + 1e-3
    assert fine[-1] >= coarse[6] - 1e-3
    current = catalogue()["current"]
    assert finer(current, probes_of(current)[0][0], 30.0) == ()


def test_settings_add_and_shapes_stay():
    effect = catalogue()["current"]
    settings = probes_of(effect)[0]
    size = (2.0, -1.0, 0.5)
    added = combined(effect, settings, size, effect.neutral)
    for name, factor, setting in zip(("north", "east", "down"), size, settings, strict=True):
        assert added[name] == pytest.approx(factor * setting[name])
    tether = catalogue()["tether"]
    probe = probes_of(tether)[0]
    held = combined(tether, probe, (3.0,), tether.neutral)
    assert held["x"] == probe[0]["x"]
    assert held["stiffness"] == pytest.approx(3.0 * probe[0]["stiffness"])


def test_a_probe_outside_the_bounds_would_be_found():
    wrong = Effect(
        "wrong", "actuation", "", "", "",
        (EffectParameter("gain", "-", 0.0, lower=0.0, upper=0.01, plausible=(0.0, 1.0)),),
    )  # fmt: skip
    assert "gain outside its bounds" in faults(wrong)


def test_probes_are_slow_enough_for_the_step():
    step = 0.02
    for effect in catalogue().values():
        for probe in (p for a in probes_of(effect, step) for p in a):
            assert effect.time_scale is None or effect.time_scale(probe) >= 0.9 * step
    assert len(probes_of(catalogue()["servo_lag"], step)) == 2
    fastest = min(p["time_constant"] for a in probes_of(catalogue()["servo_lag"]) for p in a)
    assert fastest < 0.9 * step  # without the rule one of them would be too quick


class Told:
    """Stands for a projector: columns of zeros leave nothing."""

    def signal(self, cause, probe, columns):
        return (cause, columns.shape[1]) if np.abs(columns).sum(axis=0).all() else None


@pytest.mark.parametrize(
    ("seen", "left"), [([1, 1, 1], 3), ([0, 0, 1], 1), ([1, 0, 1], 2), ([0, 0, 0], None)]
)
def test_what_the_channels_do_not_show_does_not_hide_the_rest(seen, left):
    """A camera sees the yaw of a compass mounted askew, and nothing of its roll and pitch."""
    cause = Cause("attitude_misalignment", probes_of(catalogue()["attitude_misalignment"]))
    columns = np.array([seen, seen], float)
    test = Told().signal
    found = test(cause, 0, columns) or of_visible(test, cause, 0, columns)
    if left is None:
        assert found is None
        return
    trimmed, count = found
    kept = [probe for probe, shown in zip(cause.probes[0], seen, strict=True) if shown]
    assert count == left
    assert list(trimmed.probes[0]) == kept
    assert trimmed.probes[1:] == cause.probes[1:]


@pytest.mark.parametrize("name", EFFECTS)
def test_a_mirrored_probe_is_as_far_on_the_other_side_or_at_its_bound(name):
    effect = catalogue()[name]
    for probe in (p for alternative in probes_of(effect) for p in alternative):
        other = mirrored(effect, probe)
        for parameter in effect.parameters:
            value, neutral = probe[parameter.name], parameter.neutral
            if parameter.shapes or np.isinf(neutral):
                assert other[parameter.name] == value
            else:
                wanted = np.clip(2.0 * neutral - value, parameter.lower, parameter.upper)
                assert other[parameter.name] == pytest.approx(wanted)


def test_each_of_many_settings_is_tested_alone_too():
    together = probes_of(catalogue()["added_mass"])
    both = each_alone(together)
    assert both[: len(together)] == together
    assert [probe for (probe,) in both[len(together) :]] == list(together[0])
    few = probes_of(catalogue()["current"])
    assert each_alone(few) == few
    assert each_alone(()) == ()


@pytest.mark.parametrize("name", ["frequency_scale", "battery_sag"])
def test_a_tail_that_runs_out_of_step_is_probed_within_a_beat(name):
    """Its signal has to point where that of what can just be found does: a beat lasts 2 pi."""
    (neutral,) = catalogue()[name].neutral.values()
    (first,), (second,) = probes_of(catalogue()[name])[:2]
    mildest, next_one = (value - neutral for (value,) in (first.values(), second.values()))
    assert mildest == pytest.approx(next_one / 3.0)
    beats = 2.0 * 30.0 * mildest * (1.0 if name == "frequency_scale" else 0.5 * 30.0)
    assert 2.0 * np.pi * beats < 1.0


def test_a_compass_that_bends_is_seen_at_every_phase():
    """Its error is a sine and a cosine of twice the heading: either may be all there is."""
    (both,) = probes_of(catalogue()["soft_iron"])
    assert sorted(probe["angle"] for probe in both) == [0.0, pytest.approx(np.pi / 2)]
