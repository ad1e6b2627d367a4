"""The catalogue as a whole: neutral changes nothing, bad values are refused, all is declared."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.effects import catalogue, get_effect
from fish_env.effects.extended import ExtendedModel, build_model
from fish_env.errors import EffectError, ParameterError
from fish_env.model.composition import Composition
from fish_env.model.effect import SECTIONS
from fish_env.simulator import Simulator
from tests.broken import PlainKernels
from tests.physics.cases import ALL_EFFECTS, SWIM, TUMBLE, random_inputs, random_states, swimmer

MOVING = {name: effect for name, effect in catalogue().items() if effect.acts_on_motion}
BUSY = [
    {**SWIM[0], "tail_frequency": 3.5},
    {"t": 0.05, "tail_offset": -0.2, "tail_amplitude": 0.2, "block_displacement": 0.004},
]
"""Something for every effect to act on: fast strokes, and every command but the angle changes."""
SHALLOW = replace(TUMBLE, position=(0.3, -0.2, 0.03))
"""A start where the surface matters too."""


def on(name):
    """Values that switch an effect of the catalogue on."""
    effect = get_effect(name)
    plausible = {p.name: p.plausible[0] + 0.4 * np.ptp(p.plausible) for p in effect.parameters}
    return effect.complete(ALL_EFFECTS.get(name, plausible))


def whole(effects=None):
    """A simulator whose kernel holds every effect of the catalogue."""
    simulator = Simulator(swimmer())
    simulator.model = build_model(swimmer(), effects, whole_catalogue=True)
    return simulator


def test_all_neutral_equals_the_baseline_on_states():
    """Bit for bit, in states all over and with slewing actuators."""
    rng = np.random.default_rng(0)
    baseline, extended = Simulator(swimmer()), whole()
    for state, inputs in zip(random_states(rng, 200), random_inputs(rng, 200), strict=True):
        rates = rng.normal(size=5)
        one = baseline.state_derivative(state, inputs, 3.0, rates)
        two = extended.state_derivative(state, inputs, 3.0, rates)
        assert one.tobytes() == two[: len(one)].tobytes()


def test_all_neutral_equals_the_baseline_along_a_run():
    """Bit for bit, from rest and from a tumble."""
    for start in (None, TUMBLE):
        commands = [*SWIM, {"t": 1.0, "tail_offset": -0.3}]
        one = Simulator(swimmer()).run(commands, duration_s=3.0, initial=start).states
        two = whole().run(commands, duration_s=3.0, initial=start).states
        assert one.tobytes() == np.ascontiguousarray(two[:, : one.shape[1]]).tobytes()


@pytest.mark.parametrize("name", MOVING)
def test_neutral_effects_change_nothing_while_another_is_on(name):
    """The kernel with one effect alone against that with all, the others neutral."""
    ends = []
    for declared in ((MOVING[name],), tuple(MOVING.values())):
        simulator = Simulator(swimmer())
        simulator.model = ExtendedModel(swimmer(), {name: on(name)}, declared, ())
        vars(simulator.model)["kernels"] = PlainKernels(Composition(declared), {})
        run = simulator.run(BUSY, duration_s=0.1, initial=SHALLOW)
        ends.append(run.states[:, :18])
    np.testing.assert_array_equal(ends[0], ends[1])


@pytest.mark.parametrize("name", MOVING)
def test_an_effect_that_is_on_changes_the_motion(name):
    """Otherwise the tests above would say nothing."""
    baseline = Simulator(swimmer()).run(BUSY, duration_s=0.5, initial=SHALLOW)
    changed = Simulator(swimmer(), effects={name: on(name)}).run(
        BUSY, duration_s=0.5, initial=SHALLOW
    )
    assert not np.array_equal(baseline.states[:, :14], changed.states[:, :14])


@pytest.mark.parametrize("name", MOVING)
def test_a_plausible_effect_leaves_a_finite_motion(name):
    """No NaN at either end of the plausible range."""
    for end in (0, 1):
        values = {p.name: p.plausible[end] for p in get_effect(name).parameters}
        run = Simulator(swimmer(), effects={name: values}).run(BUSY, duration_s=2.0)
        assert np.all(np.isfinite(run.states))


@pytest.mark.parametrize("effect", catalogue().values(), ids=catalogue())
def test_an_effect_declares_what_reports_need(effect):
    """Section, equation, source, units; plausible within bounds and reached by ordinary steps."""
    assert effect.section in SECTIONS
    assert effect.summary
    assert effect.equation
    assert effect.source
    assert effect.acts_on_motion or effect.acts_on_record
    for parameter in effect.parameters:
        assert parameter.unit
        assert parameter.description
        low, high = parameter.plausible
        assert parameter.lower <= low < high <= parameter.upper
        assert parameter.lower <= parameter.neutral <= parameter.upper
    if effect.time_scale is not None:
        for end in (0, 1):
            assert effect.time_scale({p.name: p.plausible[end] for p in effect.parameters}) >= 0.01
        assert effect.time_scale(effect.neutral) == np.inf


@pytest.mark.parametrize("effect", catalogue().values(), ids=catalogue())
def test_confusions_are_other_effects_and_mutual(effect):
    """In alphabetical order, so that a missing one is seen."""
    assert effect.confusable_with
    assert list(effect.confusable_with) == sorted(set(effect.confusable_with) - {effect.name})
    for other in effect.confusable_with:
        assert effect.name in get_effect(other).confusable_with, other


def test_the_catalogue_is_that_of_the_specification():
    """Names and parameter names are public; the neutral values switch each effect off."""
    public = {
        "tail_bias": {"offset": 0},
        "tail_gain": {"gain": 1},
        "tail_asymmetry": {"ratio": 0},
        "offset_gain": {"gain": 1},
        "swing_loss": {"per_radian": 0},
        "angle_limit": {"lower": -np.inf, "upper": np.inf},
        "beat_load": {"offset": 0, "load": 0},
        "side_load": {"swing": 0, "beat": 0},
        "servo_lag": {"time_constant": 0},
        "servo_rate_limit": {"rate": np.inf},
        "servo_torque_limit": {"torque": np.inf, "speed": None},
        "servo_delay": {"delay": 0},
        "servo_backlash": {"gap": 0},
        "tail_flexibility": {"natural_frequency": np.inf, "damping_ratio": 1},
        "body_flexibility": {"stiffness": np.inf, "natural_frequency": None, "damping_ratio": None},
        "frequency_scale": {"scale": 1},
        "battery_sag": {"rate": 0},
        "block_scale": {"scale": 1},
        "block_lag": {"time_constant": 0},
        "added_mass": dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 0),
        "block_reaction": {"scale": 0},
        "linear_drag": dict.fromkeys(("surge", "sway", "heave"), 0),
        "quadratic_damping": dict.fromkeys(("roll", "pitch", "yaw"), 0),
        "cross_flow_drag": dict.fromkeys(("sway", "heave"), 0),
        "tail_reactive": {"scale": 0},
        "tail_stall": {"loss": 0, "onset": None, "width": None},
        "wake_fraction": {"fraction": 0},
        "wake_memory": {"time_constant": 0},
        "offset_drag": {"coefficient": 0},
        "buoyancy_offset": {"mass": 0},
        "hull_compression": {"rate": 0},
        "water_ingress": {"rate": 0, "x": None},
        "com_offset": dict.fromkeys("xyz", 0),
        "current": dict.fromkeys(("north", "east", "down"), 0),
        "wave": {
            "amplitude": 0,
            "frequency": None,
            "phase": None,
            "heading": 0,
            "tank_depth": np.inf,
        },
        "surface_drag": {"gain": 0, "depth": None},
        "surface_piercing": {"height": 0, "slenderness": None},
        "water_density": {"scale": 1},
        "bubbles": {"mass": 0, "x": None},
        "wall_effect": {"gain": 0, "distance": None, "heading": None, "range": None},
        "floor_effect": {"gain": 0, "depth": None, "range": None},
        "tether": dict.fromkeys(("stiffness", "x", "y", "z", "slack", "attach_x"), 0),
        "clock_scale": {"scale": 1},
        "clock_skew": {"scale": 1},
        "gyro_scale": dict.fromkeys("pqr", 1),
        "marker_offset": dict.fromkeys("xyz", 0),
        "camera_tilt": {"roll": 0, "pitch": 0},
        "refraction": {"height": np.inf},
        "soft_iron": {"amplitude": 0, "angle": None},
        "imu_lowpass": {"cutoff": np.inf},
        "sensor_delay": {"delay": 0, "camera_later": 0, "depth_later": 0},
        "gyro_bias": dict.fromkeys("pqr", 0),
        "attitude_misalignment": dict.fromkeys(("roll", "pitch", "yaw"), 0),
        "depth_bias": {"offset": 0},
        "position_scale": {"scale": 1},
    }
    shipped = {
        name: {
            key: value if public[name].get(key, 0) is not None else None
            for key, value in effect.neutral.items()
        }
        for name, effect in catalogue().items()
    }
    assert shipped == public


def test_the_drive_acts_in_the_order_from_command_to_water():
    """Amplitude and bias, end stops, delay, the servo's limits, its play, the soft tail."""
    order = [name for name, effect in catalogue().items() if effect.section == "actuation"]
    chain = ("tail_asymmetry", "tail_bias", "angle_limit", "servo_rate_limit", "servo_lag")
    chain = (*chain, "servo_backlash", "tail_flexibility")
    assert (
        order.index("servo_rate_limit")
        < order.index("servo_torque_limit")
        < order.index("servo_lag")
    )
    assert [name for name in order if name in chain] == list(chain)
    assert order.index("block_scale") < order.index("block_lag")


@pytest.mark.parametrize(
    ("effects", "problem"),
    [
        ({"servo_lagg": {}}, "did you mean 'servo_lag'"),
        ({"current": {"nort": 0.1}}, "no parameter 'nort'"),
        ({"current": {"north": float("nan")}}, "not finite"),
        ({"current": {"north": float("inf")}}, "not finite"),
        ({"servo_lag": {"time_constant": -0.1}}, "between 0.0 and 1.0"),
        ({"added_mass": {"surge": -1.0}}, "added_mass.surge"),
    ],
)
def test_a_wrong_effect_is_refused(effects, problem):
    with pytest.raises(EffectError, match=problem):
        Simulator(swimmer(), effects=effects)


def test_records_vary_parameters_and_effects_per_fish():
    """A path of the fish and one of an effect, one number for each fish."""
    model = build_model(swimmer(), {"current": {"north": 0.1}})
    record = model.records({"tail.area": [0.01, 0.012], "effects.current.north": [0.2, 0.3]})
    names = model.kernels.parameter_names
    assert record[names.index("tail_area")].tolist() == [0.01, 0.012]
    assert record[names.index("current.north")].tolist() == [0.2, 0.3]
    with pytest.raises(ParameterError, match="not a parameter"):
        model.records({"effects.current.nort": 0.1})
    with pytest.raises(ParameterError, match="not a parameter"):
        model.records({"tail.aera": 0.1})


def test_the_order_of_effects_does_not_depend_on_how_they_are_given():
    """Hooks run in the catalogue's order, so a file and a call give the same bits."""
    one = dict(list(ALL_EFFECTS.items()))
    two = dict(reversed(list(ALL_EFFECTS.items())))
    runs = [
        Simulator(swimmer(), effects=effects).run(SWIM, duration_s=0.5, initial=TUMBLE)
        for effects in (one, two)
    ]
    assert runs[0].states.tobytes() == runs[1].states.tobytes()
