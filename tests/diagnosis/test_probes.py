"""What is tried of each cause: inside physical bounds, never neutral, all that it can do."""

import pytest

from fish_env.diagnosis.causes import probes_of
from fish_env.effects import catalogue
from fish_env.model.effect import Effect, EffectParameter

EFFECTS = sorted(catalogue())


def faults(effect: Effect) -> list[str]:
    """What is wrong with the probes of an effect."""
    bounds = {p.name: (p.lower, p.upper) for p in effect.parameters}
    found = [] if probes_of(effect) else ["none"]
    for alternative in probes_of(effect):
        switched = {n for probe in alternative for n in effect.switching
                    if probe[n] != effect.neutral[n]}  # fmt: skip
        if switched != set(effect.switching):
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
    phases = {probe["phase"] for alternative in probes_of(catalogue()["wave"])
              for probe in alternative}  # fmt: skip
    frequencies = {a[0]["frequency"] for a in probes_of(catalogue()["wave"])}
    assert len(phases) == 2
    assert len(frequencies) == 3


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
