"""A command that reaches the tail late: exactly, in runs, batches and step by step."""

import numpy as np
import pytest

from fish_env.data.schema import CommandSteps
from fish_env.effects.extended import build_model
from fish_env.model.grid import Grid
from fish_env.model.history import RECORD, forget, history_rows
from fish_env.simulator import InitialState, Simulator
from tests.physics.cases import swimmer
from tests.unit.effects.support import assert_same_motion, run

DELAY = 0.137
SEEN = {"servo_backlash": {"gap": 1e-12}}
"""A play that is none: its memory is the angle of the tail at each sample."""


def delayed(delay, **more):
    return {"servo_delay": {"delay": delay}, **more}


def busy(seed=0, count=8):
    """Commands that change several times within the delay."""
    rng = np.random.default_rng(seed)
    times = np.array([0.0, 0.05, 0.1, 0.13, 0.2, 0.21, 0.4, 0.8])[:count]
    low, high = [-0.4, 0.1, 0.5, -0.01, -0.5], [0.4, 0.5, 4.0, 0.01, 0.5]
    return CommandSteps(times, rng.uniform(low, high, (count, 5)))


def shifted(steps, delay):
    """The same schedule for an ideal servo: the tail's commands later, the block's at once."""
    times = np.union1d(steps.times_s, steps.times_s[1:] + delay)
    late = CommandSteps(np.append(-1.0, steps.times_s[1:] + delay), steps.values)
    return CommandSteps(times, np.hstack([late.at(times)[:, :3], steps.at(times)[:, 3:]]))


def test_commands_that_change_within_the_delay_arrive_each_in_its_turn():
    """The motion of an ideal servo that is told everything later, before the run the first."""
    steps = busy()
    begin = steps.values[0, 2] * 2 * np.pi * DELAY
    for dt in (0.01, 0.0043):
        late = Simulator(swimmer(), dt, delayed(DELAY)).run(
            steps, 2.0, InitialState(tail_phase=0.3)
        )
        ideal = Simulator(swimmer(), dt).run(
            shifted(steps, DELAY), 2.0, InitialState(tail_phase=0.3 - begin)
        )
        assert_same_motion(late, ideal, atol=1e-11)


def angle_told(steps, time_s, phase=0.0):
    """The commanded angle at any time, the first command running before the first time."""
    edges = np.append(steps.times_s[1:], np.inf)
    starts = np.append(-np.inf, steps.times_s[1:])
    for edge, start, row in zip(edges, starts, steps.values, strict=True):
        if start <= time_s < edge:
            since = time_s - max(start, steps.times_s[0])
            return row[0] + row[1] * np.sin(phase + 2 * np.pi * row[2] * since)
        phase += 2 * np.pi * row[2] * (edge - max(start, steps.times_s[0]))
    raise AssertionError


@pytest.mark.parametrize("dt", [0.01, 0.0073])
@pytest.mark.parametrize("delay", [0.004, 0.05, DELAY, 0.6])
def test_the_angle_is_the_commanded_angle_a_delay_ago(dt, delay):
    """xi(t) = cmd(t - delay) to rounding, whatever delay and step have to do with each other."""
    steps = busy(1)
    times = np.arange(0.0, 1.5, 0.0131)
    late = Simulator(swimmer(), dt, delayed(delay, **SEEN)).run(steps, sample_times_s=times)
    expected = [angle_told(steps, time - delay) for time in times]
    np.testing.assert_allclose(late["servo_backlash.angle"], expected, atol=1e-9)


def test_a_constant_beat_lags_in_phase_alone():
    one = run(delayed(DELAY))
    two = run(None, tail_phase=-4 * np.pi * DELAY)
    assert_same_motion(one, two, atol=1e-12)


def test_bias_gain_and_asymmetry_do_not_mind_the_delay():
    """They belong to the command, so the delayed angle is theirs too."""
    drive = {
        "tail_bias": {"offset": 0.05},
        "tail_gain": {"gain": 0.8},
        "tail_asymmetry": {"ratio": 0.1},
        "frequency_scale": {"scale": 0.9},
    }
    late = run({**delayed(DELAY, **SEEN), **drive}, rate_hz=100)["servo_backlash.angle"]
    begin = -0.9 * 4 * np.pi * DELAY
    early = run({**SEEN, **drive}, rate_hz=100, tail_phase=begin)["servo_backlash.angle"]
    np.testing.assert_allclose(late, early, atol=1e-12)


class Swarm:
    """Fish with different delays, and all that advancing them takes."""

    def __init__(self, delays, slew=np.inf):
        self.model = build_model(swimmer(), delayed(0.1, **SEEN))
        self.kernels = self.model.kernels
        self.par = self.model.records({"effects.servo_delay.delay": delays})
        self.count = len(delays)
        self.state = np.zeros((len(self.kernels.state_names), self.count))
        self.state[3], self.state[7] = 1.0, 0.1
        self.state[13] = np.linspace(0.0, 3.0, self.count)
        self.inputs = np.tile([[0.1], [0.3], [2.0], [0.0], [0.0]], self.count)
        self.slew = np.full((5, self.count), slew)
        self.kernels.initialise(self.state, self.inputs, self.par, np.zeros(self.count))

    def advance(self, targets, steps, begin=0.0, history=None, threads=1):
        """Some steps of 10 ms towards each of the targets (segments, 5), in place."""
        segments = len(targets)
        commands = np.repeat(np.asarray(targets, float)[:, :, None], self.count, axis=2)
        grid = Grid(
            np.arange(segments),
            0.01 * steps * np.arange(segments),
            np.full(segments, steps),
            np.full(segments, 0.01),
            np.ones(segments, np.int64),
        )
        failed = np.full(self.count, np.inf)
        clock = np.full(self.count, begin)
        trace = np.zeros((segments * steps, len(self.state), self.count))
        self.kernels.advance(
            self.state, self.inputs, self.par, self.slew, clock, commands, grid,
            tables=self.model.tables, failed_at=failed, history=history, threads=threads,
            trace=trace,
        )  # fmt: skip
        assert np.all(failed == np.inf)
        return trace


TARGETS = [
    [-0.2, 0.4, 3.0, 0.0, 0.0],
    [0.3, 0.1, 1.0, 0.01, 0.1],
    [0.0, 0.2, 2.5, 0.0, 0.0],
    [0.2, 0.35, 2.0, 0.0, 0.0],
]
DELAYS = np.concatenate([[0.0, 0.01, 0.033], np.linspace(0.0, 0.25, 30)])


def test_each_fish_of_a_batch_has_its_own_delay():
    """The same bits as when it swims alone, on one thread or two; no delay is no delay."""
    together = Swarm(DELAYS)
    together.advance(TARGETS, 7)
    for lane in (0, 1, 2, 15, 16, 32):
        alone = Swarm(DELAYS[lane : lane + 1])
        alone.state[13] = np.linspace(0.0, 3.0, len(DELAYS))[lane]
        alone.kernels.initialise(alone.state, alone.inputs, alone.par, np.zeros(1))
        alone.advance(TARGETS, 7)
        assert alone.state[:, 0].tobytes() == together.state[:, lane].tobytes()
    many = np.tile(DELAYS, 9)
    states = []
    for threads in (1, 2):
        swarm = Swarm(many)
        swarm.advance(TARGETS, 7, threads=threads)
        states.append(swarm.state.tobytes())
    assert states[0] == states[1]


def test_a_history_carried_from_call_to_call_is_one_run():
    """As an environment does: a few steps a call, what was told kept between them."""
    whole, pieces = Swarm(DELAYS), Swarm(DELAYS)
    whole.advance(TARGETS, 7)
    history = np.zeros((history_rows(DELAYS.max(), 0.01), len(DELAYS)))
    for i, target in enumerate(TARGETS):
        pieces.advance([target], 7, begin=0.07 * i, history=history)
    np.testing.assert_allclose(pieces.state, whole.state, rtol=0, atol=1e-12)


def test_slewing_actuators_are_heard_late_as_they_slewed():
    """A delay of whole steps: each sample shows the angle of so many samples before."""
    late, now = Swarm([0.08], slew=3.0), Swarm([0.0], slew=3.0)
    row = late.kernels.state_names.index("servo_backlash.angle")
    angles = [swarm.advance(TARGETS, 20)[:, row, 0] for swarm in (late, now)]
    np.testing.assert_allclose(angles[0][8:], angles[1][:-8], atol=1e-11)


def test_a_fish_that_begins_anew_has_heard_nothing():
    """The others go on; a history too short for the new fish grows and keeps what it held."""
    swarm = Swarm([0.05, 0.05])
    history = np.zeros((history_rows(0.05, 0.01), 2))
    swarm.advance(TARGETS[:1], 13, history=history)
    before = history.copy()
    longer = forget(history, np.array([1]), history_rows(0.2, 0.01))
    slots, more = (len(before) - 1) // RECORD, (len(longer) - 1) // RECORD
    assert longer[0].tolist() == [13.0, 0.0]
    for step in range(13 - slots, 13):
        told = before[1 + RECORD * (step % slots) : 1 + RECORD * (step % slots + 1), 0]
        kept = longer[1 + RECORD * (step % more) : 1 + RECORD * (step % more + 1), 0]
        np.testing.assert_array_equal(kept, told)
    assert forget(longer, np.array([0]), 1) is longer
    assert longer[0].tolist() == [0.0, 0.0]


def test_without_a_delay_no_history_is_kept():
    assert history_rows(0.0, 0.01) == 0
    assert build_model(swimmer(), delayed(0.1)).command_delay == 0.1
    assert build_model(swimmer(), SEEN).command_delay == 0.0
