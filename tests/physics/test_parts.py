"""Steps that are parted where the rate of the tail jumps: accurate, and the same in any company."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data.schema import CommandSteps
from fish_env.effects import catalogue
from fish_env.effects.extended import build_model
from fish_env.effects.kinds import KINDS, group_of, together_with
from fish_env.model.corners import cubic, rises
from fish_env.model.grid import Grid
from fish_env.model.jit import py_function
from fish_env.model.records import Tail
from fish_env.simulator import Simulator
from tests.broken import broken_simulator
from tests.physics.cases import swimmer

LIMITED = {"servo_rate_limit": {"rate": 5.0}}
LOOSE = {"servo_backlash": {"gap": 0.08}}
LATE = {"servo_delay": {"delay": 0.043}}
CASES = {
    "rate limit, play and delay": {**LIMITED, **LOOSE, **LATE},
    "rate limit": LIMITED,
    "play": LOOSE,
    "stops": {"angle_limit": {"lower": -0.3, "upper": 0.35}},
    "uneven strokes": {"tail_asymmetry": {"ratio": 0.2}},
    "a lag": {"servo_lag": {"time_constant": 0.03}},
    "a lag shorter than a step": {"servo_lag": {"time_constant": 0.008}},
    "a flexible tail": {"tail_flexibility": {"natural_frequency": 5.0, "damping_ratio": 0.3}},
}
FINE = 1.0 / 3200.0


def jumps(seed: int, seconds: float, every: float = 1.0) -> CommandSteps:
    """Commands that jump at random times, all at once."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5 * every, 1.5 * every, int(2 * seconds / every)))
    times = np.append(0.0, times[times < seconds])
    low, high = np.array([-0.5, 0.0, 0.5, -0.01, -0.2]), np.array([0.5, 0.6, 3.0, 0.01, 0.2])
    return CommandSteps(times, rng.uniform(low, high, (len(times), 5)))


def apart(one, other) -> tuple[float, float]:
    """Largest distance (mm) and largest angle (deg) between two runs."""
    distance = np.linalg.norm(one.states[:, :3] - other.states[:, :3], axis=1)
    cosine = np.abs(np.sum(one.states[:, 3:7] * other.states[:, 3:7], axis=1)).clip(0.0, 1.0)
    return 1e3 * distance.max(), np.degrees(2.0 * np.arccos(cosine.min()))


@pytest.mark.parametrize("name", CASES)
def test_a_minute_of_jumps_comes_out_as_in_fine_steps(name):
    """At 100 Hz within a millimetre; steps that are not parted miss by up to a metre or two."""
    commands = jumps(1, 60.0)
    coarse = Simulator(swimmer(), 0.01, CASES[name]).run(commands, 60.0)
    fine = Simulator(swimmer(), FINE, CASES[name]).run(commands, 60.0)
    distance, angle = apart(coarse, fine)
    assert distance < 1.0
    assert angle < 0.02


@pytest.mark.parametrize("name", ["rate limit", "play", "stops", "a lag shorter than a step"])
def test_without_parts_the_same_jumps_are_seen(name):
    """The check above fails on steps that are taken whole."""
    commands, effects = jumps(1, 2.0, 0.2), CASES[name]
    fine = Simulator(swimmer(), FINE, effects).run(commands, 2.0)
    parted = Simulator(swimmer(), 0.01, effects).run(commands, 2.0)
    whole = broken_simulator({"MOST_PARTS = 32": "MOST_PARTS = 1"}, swimmer(), 0.01, effects)
    assert apart(whole.run(commands, 2.0), fine)[0] > 20 * apart(parted, fine)[0]


def test_a_lag_of_a_fifth_of_a_step_runs():
    """Where a command jumps, its tail is faster than any servo; the fish stays finite."""
    effects = {"servo_lag": {"time_constant": 0.002}}
    run = Simulator(swimmer(), 0.01, effects).run(jumps(1, 20.0, 0.3), 20.0)
    assert np.isfinite(run.states).all()


def advanced(model, record, count: int) -> np.ndarray:
    """States of some fish after a second of a beat, each with its own record."""
    kernels = model.kernels
    state = np.zeros((len(kernels.state_names), count))
    state[3], state[7] = 1.0, 0.1
    inputs = np.repeat(np.array([0.1, 0.45, 2.3, 0.0, 0.1])[:, None], count, axis=1)
    kernels.initialise(state, inputs, record, np.zeros(count))
    grid = Grid(
        np.zeros(1, np.int64), np.zeros(1), np.array([100]), np.array([0.01]), np.array([100])
    )
    kernels.advance(
        state, inputs, record, np.full((5, count), np.inf), np.zeros(count), inputs[None].copy(),
        grid, tables=model.tables, failed_at=np.full(count, np.inf),
    )  # fmt: skip
    return state


def test_a_fish_moves_alike_in_any_company():
    """To the last bit, whether the others of its block have corners in the step or not."""
    model = build_model(swimmer(), {**LIMITED, **LOOSE, **LATE})
    count = 19
    rate = np.where(np.arange(count) % 3 == 0, np.inf, np.linspace(2.0, 9.0, count))
    gap = np.where(np.arange(count) % 2 == 0, 0.0, np.linspace(0.02, 0.15, count))
    delay = np.where(np.arange(count) % 5 < 2, 0.0, np.linspace(0.01, 0.1, count))
    changes = {
        "effects.servo_rate_limit.rate": rate,
        "effects.servo_backlash.gap": gap,
        "effects.servo_delay.delay": delay,
    }
    record = np.ascontiguousarray(model.records(changes))
    together = advanced(model, record, count)
    for i in range(count):
        alone = advanced(model, np.ascontiguousarray(record[:, i : i + 1]), 1)
        assert np.array_equal(together[:, i], alone[:, 0]), i
    lean = build_model(swimmer())
    none = advanced(lean, lean.record.copy(), 1)
    assert np.array_equal(together[:18, 0], none[:18, 0])


@pytest.mark.parametrize("name", ["servo_backlash", "current", "linear_drag", "tail_reactive"])
def test_a_kind_gives_the_same_bits_as_the_whole_catalogue(name):
    """The smallest kind leaves out what is off, which changes nothing."""
    values = {p.name: p.plausible[1] for p in catalogue()[name].parameters if p.plausible}
    small = build_model(swimmer(), {name: values})
    whole = replace(small, declared=tuple(e for e in catalogue().values() if e.acts_on_motion))
    assert len(small.declared) < len(whole.declared) / 2
    states = [advanced(model, model.record.copy(), 1)[:18] for model in (small, whole)]
    assert np.array_equal(*states)


def test_every_effect_has_a_small_kind():
    """One effect alone never takes all others along, and two that share no kind take all."""
    moving = {name: e for name, e in catalogue().items() if e.acts_on_motion}
    for name in moving:
        assert len(together_with({name})) < len(moving) / 3
    assert {group_of(e) for e in moving.values()} == set().union(*KINDS)
    loaded = {name for name, e in moving.items() if e.loaded}
    assert {e.name for e in together_with({"servo_backlash", "current"})} == set(moving) - loaded
    assert loaded <= {e.name for e in together_with(loaded)}


def test_a_crossing_is_found_where_it_is():
    """Of a sine that rises through a level within a part of a step, to a millionth of it."""
    begin, length, level = 0.3, 0.01, 0.315
    tail, later = (Tail(np.sin(t), np.cos(t), -np.sin(t)) for t in (begin, begin + length))
    a, b, c, d = py_function(cubic)(tail, later, length)
    share = py_function(rises)(a - level, b, c, d)
    assert share == np.inf
    level = 0.3
    share = py_function(rises)(a - level, b, c, d)
    assert abs(begin + share * length - np.arcsin(level)) < 1e-8
