"""An effect that a user writes in a file of their own."""

import textwrap

import numpy as np
import pytest

from fish_env.effects import load_effect_file
from fish_env.effects.extended import build_model
from fish_env.errors import EffectError
from fish_env.model.effect import Effect, EffectParameter
from fish_env.params.io import load_fish
from fish_env.sensing import true_times
from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import dry, swimmer

SURGE_DRAG = '''
"""Quadratic surge drag."""

from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench


@kernel
def drag(motion, tail, inputs, centre, fish, e):
    """-c u |u| forward."""
    return Wrench(-e.coefficient * motion.u * abs(motion.u), 0.0, 0.0, 0.0, 0.0, 0.0)


EFFECT = Effect(
    name="surge_drag",
    section="hydrodynamics",
    summary="More drag ahead.",
    equation="F_x = -c u |u|",
    source="made up",
    parameters=(EffectParameter("coefficient", "N s^2/m^2", 0.0, 0.0, 100.0, (0.0, 5.0), "c"),),
    hooks={"wrench": drag},
)
'''
AHEAD = InitialState(velocity_body=(0.5, 0.0, 0.0))
STILL = [{"t": 0.0}]


@pytest.fixture
def effect_file(tmp_path):
    file = tmp_path / "surge_drag.py"
    file.write_text(SURGE_DRAG)
    return file


def coasting(time):
    """Surge of a fish of 2 kg with nothing but 3 N s^2/m^2 of drag, m/s."""
    return 0.5 / (1 + 3.0 * 0.5 * time / 2.0)


def test_a_users_effect_moves_the_fish_as_its_equation_says(effect_file):
    """Compiled in beside the catalogue; at its neutral value the fish is the baseline."""
    # A centre of mass at O_b, so that drag does not pitch the fish.
    fish = dry(swimmer().replace({"mass.static_moment_rest[2]": -0.009}))
    effect = load_effect_file(effect_file)
    simulator = Simulator(fish, 0.01, {"surge_drag": {"coefficient": 3.0}}, [effect])
    run = simulator.run(STILL, duration_s=2.0, initial=AHEAD)
    np.testing.assert_allclose(run["u"], coasting(run.time_s), atol=1e-9)
    terms = simulator.wrench_by_term(AHEAD.vector())
    assert terms["surge_drag"][0] == pytest.approx(-0.75)
    off = Simulator(swimmer(), 0.01, user_effects=[effect])
    one = off.run(STILL, duration_s=1.0, initial=AHEAD).states[:, :18]
    two = Simulator(swimmer(), 0.01).run(STILL, duration_s=1.0, initial=AHEAD).states
    assert np.ascontiguousarray(one).tobytes() == two.tobytes()


def test_a_fish_file_can_name_an_effect_that_lies_beside_it(effect_file):
    """The same as giving it in Python; the file of the fish keeps the value."""
    fish_file = effect_file.with_name("mine.yaml")
    fish_file.write_text(
        "name: mine\nbase: zheng-2021-a\neffects: {surge_drag: {coefficient: 3}}\n"
    )
    from_file = Simulator(fish_file, 0.01, trust_effects=True)
    in_python = Simulator(
        swimmer(), 0.01, {"surge_drag": {"coefficient": 3.0}}, [load_effect_file(effect_file)]
    )
    runs = [x.run(STILL, duration_s=1.0, initial=AHEAD).states for x in (from_file, in_python)]
    assert runs[0].tobytes() == runs[1].tobytes()
    assert from_file.wrench_by_term(AHEAD.vector())["surge_drag"][0] == pytest.approx(-0.75)


def test_an_effect_that_is_nowhere_says_where_it_was_looked_for(tmp_path):
    fish_file = tmp_path / "mine.yaml"
    fish_file.write_text(
        "name: mine\nbase: zheng-2021-a\neffects: {surge_drag: {coefficient: 3}}\n"
    )
    with pytest.raises(EffectError, match=r"put surge_drag\.py beside the fish file"):
        Simulator(load_fish(fish_file))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("EFFECT = = 1", "failed: invalid syntax"),
        ("import nowhere_to_be_found", "failed: No module named"),
        ("x = 1", "define EFFECT"),
        ("EFFECT = 3", "define EFFECT"),
        (SURGE_DRAG.replace('name="surge_drag"', 'name="current"'), "taken by a shipped effect"),
        (SURGE_DRAG.replace('name="surge_drag"', 'name="surge drag"'), "letters, digits"),
        (SURGE_DRAG.replace("hydrodynamics", "hydro"), "unknown section 'hydro'"),
        (SURGE_DRAG.replace('{"wrench"', '{"force"'), "no stage"),
        (SURGE_DRAG.replace("hooks=", "states={'tail': ('a',)}, hooks="), "its own hooks"),
        (SURGE_DRAG.replace("hooks=", "states={'wrench': ('a',)}, hooks="), "initial_states"),
    ],
)
def test_a_broken_effect_file_is_refused(tmp_path, text, problem):
    """Each with the file's name and what is wrong with it."""
    file = tmp_path / "surge_drag.py"
    file.write_text(textwrap.dedent(text))
    with pytest.raises(EffectError, match=problem) as caught:
        load_effect_file(file)
    assert "surge_drag.py" in str(caught.value)


def test_a_missing_effect_file_is_refused(tmp_path):
    with pytest.raises(EffectError, match=r"surge_drag\.py: no such effect file"):
        load_effect_file(tmp_path / "surge_drag.py")


def test_an_effect_file_must_define_the_effect_it_is_named_for(effect_file):
    fish_file = effect_file.with_name("mine.yaml")
    fish_file.write_text("name: mine\nbase: zheng-2021-a\neffects: {other: {coefficient: 3}}\n")
    effect_file.rename(effect_file.with_name("other.py"))
    with pytest.raises(EffectError, match=r"other\.py defines 'surge_drag', its file says 'other'"):
        Simulator(fish_file, trust_effects=True)


def test_a_changed_effect_file_is_compiled_again(effect_file):
    """Machine code kept for an earlier version would be silently wrong."""
    ends = []
    for text in (SURGE_DRAG, SURGE_DRAG.replace("-e.coefficient", "-2.0 * e.coefficient")):
        effect_file.write_text(text)
        effects = {"surge_drag": {"coefficient": 3.0}}
        simulator = Simulator(swimmer(), 0.01, effects, [load_effect_file(effect_file)])
        ends.append(simulator.wrench_by_term(AHEAD.vector())["surge_drag"][0])
    assert ends[1] == pytest.approx(2 * ends[0])


def test_a_users_measurement_effect_stays_out_of_the_kernel():
    """It has no hooks, so no row of the record: one too many would be written beyond the work."""
    late = Effect(
        name="late_clock",
        section="measurement",
        summary="",
        equation="",
        source="",
        parameters=(EffectParameter("scale", "-", 1.0, 0.5, 2.0),),
        sample_time=lambda recorded, values: recorded * values["scale"],
    )
    model = build_model(swimmer(), {"late_clock": {"scale": 1.1}}, [late])
    assert model.declared == ()
    assert len(model.record) == len(model.kernels.parameter_names)
    assert true_times(model, [0.0, 10.0]) == pytest.approx([0.0, 11.0])
    both = build_model(swimmer(), {"late_clock": {"scale": 1.1}, "current": {"north": 0.1}}, [late])
    assert len(both.record) == len(both.kernels.parameter_names)
