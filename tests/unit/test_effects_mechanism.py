"""What an effect may declare: states, memory, a late command; and that it stays fast."""

import re
from dataclasses import replace

import numba
import numpy as np
import pytest

from fish_env.effects.extended import build_model
from fish_env.errors import EffectError
from fish_env.model.effect import Effect, EffectParameter
from fish_env.model.grid import Grid
from fish_env.model.jit import kernel
from fish_env.model.records import Wrench
from fish_env.simulator import Simulator
from tests.physics.cases import swimmer

ON = EffectParameter("on", "-", 0.0, 0.0, 1.0, (0.0, 1.0), "switch")
SWIM = [{"t": 0.0, "tail_amplitude": 0.3, "tail_frequency": 2.0, "tail_offset": 0.1}]


def declared(name, **parts):
    return Effect(name, "actuation", "s", "e", "s", (ON,), **parts)


@kernel
def count_steps(tail, inputs, phase, time, fish, e, memory, since):
    """Remembers how many steps were made, the longest time seen within one, and the angle."""
    steps, longest, _ = memory
    return tail, (steps + 1.0, max(longest, since), tail.angle)


@kernel
def remember_nothing(inputs, tail, fish, e):
    return 0.0, 0.0, tail.angle


@kernel
def both(tail, inputs, phase, time, fish, e, states, memory, since):
    """A state that integrates the tail's rate; a memory of where the state was."""
    (angle,), (kept,) = states, memory
    return tail, (tail.rate,), (kept + (angle - kept),)


@kernel
def start_both(inputs, tail, fish, e):
    return tail.angle, tail.angle


@kernel
def lagged_push(motion, tail, inputs, centre, fish, e, states):
    """A forward force that grows to 1 N with a time constant of 0.5 s."""
    (force,) = states
    return Wrench(e.on * force, 0.0, 0.0, 0.0, 0.0, 0.0), ((1.0 - force) / 0.5,)


@kernel
def from_the_tail(inputs, tail, fish, e):
    return (tail.angle,)


COUNTER = declared(
    "counter",
    hooks={"tail": count_steps},
    memory={"tail": ("steps", "longest", "angle")},
    initial_states=remember_nothing,
)
BOTH = declared(
    "both",
    hooks={"tail": both},
    states={"tail": ("angle",)},
    memory={"tail": ("kept",)},
    initial_states=start_both,
)
PUSH = declared(
    "push",
    hooks={"wrench": lagged_push},
    states={"wrench": ("force",)},
    initial_states=from_the_tail,
)


@pytest.fixture(scope="module")
def simulator():
    return Simulator(swimmer(), 0.01, user_effects=[COUNTER, BOTH, PUSH])


def test_memory_takes_its_value_at_the_end_of_each_step(simulator):
    """Once a step, not once a stage; the instant it sees last is the step's end."""
    run = simulator.run(SWIM, duration_s=0.5, rate_hz=20)
    np.testing.assert_allclose(run["counter.steps"], 100 * run.time_s, atol=1e-9)
    np.testing.assert_allclose(run["counter.longest"][1:], 0.01, rtol=1e-12)
    expected = 0.1 + 0.3 * np.sin(4 * np.pi * run.time_s)
    np.testing.assert_allclose(run["counter.angle"], expected, atol=1e-12)


def test_states_and_memory_of_one_hook_do_not_mix(simulator):
    """The state is integrated; the memory is what it was at the last stage of the step."""
    run = simulator.run(SWIM, duration_s=0.5, rate_hz=20)
    expected = 0.1 + 0.3 * np.sin(4 * np.pi * run.time_s)
    np.testing.assert_allclose(run["both.angle"], expected, atol=1e-6)
    np.testing.assert_allclose(run["both.kept"], run["both.angle"], atol=1e-4)


def test_memory_has_no_derivative_and_states_have_theirs(simulator):
    names = simulator.model.kernels.state_names
    assert names[-4:] == ("counter.steps", "counter.longest", "counter.angle", "both.kept")
    slopes = dict(zip(names, simulator.state_derivative([0, 0, 0, 1] + [0] * 9), strict=True))
    assert [slopes[name] for name in names[-4:]] == [0.0] * 4
    assert slopes["push.force"] == pytest.approx(2.0)


def test_a_force_may_have_states(simulator):
    """They start behind the commands and the tail, and the force is theirs."""
    effects = {"push": {"on": 1.0}}
    pushed = Simulator(swimmer(), 0.01, effects, [COUNTER, BOTH, PUSH])
    run = pushed.run([{"t": 0.0, "tail_offset": 0.2}], duration_s=1.0)
    expected = 1.0 - 0.8 * np.exp(-run.time_s / 0.5)
    np.testing.assert_allclose(run["push.force"], expected, atol=1e-8)
    terms = pushed.wrench_by_term(run.states[-1], run.inputs[-1])
    np.testing.assert_allclose(terms["push"], [expected[-1], 0, 0, 0, 0, 0], atol=1e-8)


def test_states_start_behind_the_effects_before_theirs():
    """A biased tail starts its lag at the bias, so nothing moves when nothing is told."""
    effects = {
        "tail_bias": {"offset": 0.2},
        "servo_lag": {"time_constant": 0.1},
        "tail_flexibility": {"natural_frequency": 5.0},
    }
    still = Simulator(swimmer(), 0.01, effects)
    angle = still.outputs(still.run([{"t": 0.0}], duration_s=1.0))["tail_angle"]
    np.testing.assert_allclose(angle, 0.2, atol=1e-12)


@pytest.mark.parametrize(
    ("parts", "problem"),
    [
        ({"memory": {"tail": ("a",)}}, "its own hooks"),
        ({"hooks": {"tail": both}, "memory": {"tail": ("a",)}}, "initial_states"),
        (
            {
                "hooks": {"tail": both, "wrench": both},
                "states": {"tail": ("a",)},
                "memory": {"wrench": ("b",)},
                "initial_states": start_both,
            },
            "one of its own hooks",
        ),
        (
            {
                "hooks": {"wrench": both},
                "memory": {"wrench": ("b",)},
                "initial_states": start_both,
            },
            "inputs and tail alone",
        ),
        ({"command_delay": "late"}, "no parameter 'late'"),
    ],
)
def test_a_declaration_that_cannot_be_composed_is_refused(parts, problem):
    with pytest.raises(EffectError, match=problem):
        declared("wrong", **parts)


def test_an_effect_of_a_shipped_name_is_refused():
    mine = Effect("current", "actuation", "", "", "", (ON,), hooks={"tail": both})
    with pytest.raises(EffectError, match="taken by a shipped effect"):
        build_model(swimmer(), user_effects=[mine])


def take_a_step(model, lanes=16):
    """One step of one block of fish, so that the kernel for blocks is compiled."""
    kernels = model.kernels
    inputs = np.tile([[0.1], [0.3], [2.0], [0.0], [0.0]], lanes)
    state = np.zeros((len(kernels.state_names), lanes))
    state[3] = 1.0
    par = np.repeat(model.record, lanes, axis=1)
    one = np.ones(1, np.int64)
    grid = Grid(0 * one, np.zeros(1), one, np.full(1, 0.01), 10**9 * one)
    kernels.advance(
        state, inputs, par, np.full((5, lanes), np.inf), np.zeros(lanes), inputs[None].copy(),
        grid, tables=model.tables, failed_at=np.full(lanes, np.inf), threads=1,
    )  # fmt: skip


def share_in_vector_registers(model):
    """Share of the kernel's additions and multiplications that work on several fish at once.

    Read from the compiler's output: the time they take depends on the machine's caches too, and
    numba does not show code that it loaded from disk, so the kernel is compiled once more.
    """
    take_a_step(model)
    kept = model.kernels.entry("advance_lanes")
    options = {name: value for name, value in kept.targetoptions.items() if name != "nopython"}
    again = numba.njit(kept.py_func, **options)
    again.compile(kept.signatures[0])
    operation = r"= f(?:mul|add|sub|div)(?: [a-z]+)* (<\d+ x double>|double)"
    found = re.findall(operation, again.inspect_llvm(again.signatures[0]))
    return sum(kind != "double" for kind in found) / len(found)


@pytest.mark.slow
@pytest.mark.long
def test_the_whole_catalogue_still_runs_in_vector_registers():
    """A hook that does not vectorise takes all others out of the vector registers with it.

    What effects remember of a step is computed once for each fish by itself: a sixth of the code,
    most of it of the two effects that make the tail's rate jump; a quarter with a loaded drive.
    """
    whole = build_model(swimmer(), whole_catalogue=True)
    assert share_in_vector_registers(whole) > 0.75
    without_load = tuple(effect for effect in whole.declared if not effect.loaded)
    assert share_in_vector_registers(replace(whole, declared=without_load)) > 0.8
    without_memory = tuple(effect for effect in whole.declared if not effect.memory)
    assert share_in_vector_registers(replace(whole, declared=without_memory)) > 0.95


@kernel
def halve_until_small(motion, tail, inputs, centre, fish, e):
    """A loop that ends at another time for each fish."""
    speed = motion.u
    while speed > 0.1:
        speed *= 0.5
    return Wrench(e.on * speed, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.slow
@pytest.mark.long
def test_a_hook_that_does_not_vectorise_is_seen():
    mine = Effect(
        "halved", "hydrodynamics", "s", "e", "s", (ON,), hooks={"wrench": halve_until_small}
    )
    assert share_in_vector_registers(build_model(swimmer(), user_effects=[mine])) < 0.5
