"""One fish, many fish, one core, two cores, another process: the same bits."""

import subprocess
import sys

import numpy as np
import pytest

from fish_env.errors import SimulationDiverged
from fish_env.simulator import InitialState, Simulator, schedule, time_grid
from tests.physics import checkers
from tests.physics.cases import SWIM, TUMBLE, WATER_EFFECTS, random_states, swimmer


@pytest.mark.parametrize("count", [1, 7, 16, 33])
def test_a_fish_moves_alike_alone_and_in_a_batch(count):
    """Blocks of sixteen lanes, the last one partly filled; every lane with its own numbers."""
    checkers.check_scalar_equals_batch(Simulator, count)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("effects", [None, WATER_EFFECTS], ids=["baseline", "effects"])
def test_threads_do_not_change_the_bits(threads, effects):
    """300 fish are enough to be split between two cores."""
    checkers.check_scalar_equals_batch(Simulator, 300, threads, effects)


def test_a_run_of_the_simulator_is_a_lane_of_a_batch():
    """Simulator.run against sixteen lanes with other fish beside it, sample by sample."""
    sizes = np.linspace(0.8, 1.2, 16) * swimmer().get("tail.area")
    simulator = Simulator(swimmer(), 0.01)
    kernels, model = simulator.model.kernels, simulator.model
    commands = schedule([*SWIM, {"t": 0.33, "tail_offset": -0.2}])
    grid, starts = time_grid(np.arange(11) / 10, commands.times_s, 0.01)
    state = np.repeat(TUMBLE.vector()[:, None], 16, axis=1)
    trace = np.empty((10, len(state), 16))
    kernels.advance(
        state,
        np.repeat(commands.at([0.0]).T, 16, axis=1),
        model.records({"tail.area": sizes}),
        np.full((5, 16), np.inf),
        np.zeros(16),
        commands.at(starts)[:, :, None].copy(),
        grid,
        tables=model.tables,
        failed_at=np.full(16, np.inf),
        trace=trace,
    )
    for lane in (0, 9, 15):
        fish = swimmer().replace({"tail.area": sizes[lane]})
        run = Simulator(fish, 0.01).run(commands, duration_s=1.0, initial=TUMBLE)
        assert run.states[1:].tobytes() == np.ascontiguousarray(trace[:, :, lane]).tobytes()


CODE = """
from fish_env.simulator import Simulator
from tests.physics.cases import SWIM, TUMBLE
run = Simulator("zheng-2021-a").run(SWIM, duration_s=2.0, initial=TUMBLE)
print(run.states[-1].tobytes().hex())
"""


def test_another_process_gives_the_same_bits():
    """Nothing depends on hash seeds, on compiling afresh or on what ran before."""
    command = [sys.executable, "-c", CODE]
    there = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    here = Simulator("zheng-2021-a").run(SWIM, duration_s=2.0, initial=TUMBLE).states[-1]
    assert there == here.tobytes().hex()


def test_a_diverging_fish_says_when_and_from_where():
    """The error carries the time of the first bad step and the finite state before it."""
    wild = InitialState(velocity_body=(1000.0, 0.1, 0.0))
    with pytest.raises(SimulationDiverged) as caught:
        Simulator(swimmer(), 0.1).run(SWIM, duration_s=1.0, initial=wild)
    assert caught.value.time_s == pytest.approx(0.1)
    assert np.all(np.isfinite(caught.value.state))
    np.testing.assert_array_equal(caught.value.state[:14], wild.vector()[:14])


def test_a_diverged_fish_stays_where_it_diverged():
    """Shorter steps later in the run must not let it move on from a state of long ago."""
    wild = InitialState(velocity_body=(1000.0, 0.1, 0.0))
    with pytest.raises(SimulationDiverged) as caught:
        Simulator(swimmer(), 0.1).run(SWIM, sample_times_s=[0.0, 0.1, 0.1001, 0.2], initial=wild)
    assert caught.value.time_s == pytest.approx(0.1)
    np.testing.assert_array_equal(caught.value.state[:14], wild.vector()[:14])


def test_a_diverging_fish_leaves_the_rest_of_its_batch_untouched():
    """Its lane keeps finite numbers; all others have the bits they have without it."""
    simulator = Simulator(swimmer(), 0.05)
    kernels, model = simulator.model.kernels, simulator.model
    grid, _ = time_grid(np.arange(21) * 0.05, np.zeros(1), 0.05)
    tame = np.zeros((len(kernels.state_names), 20))
    tame[:18] = random_states(np.random.default_rng(5), 20).T
    wild = tame.copy()
    wild[7, 4] = 3000.0

    def advance(state):
        failed, trace = np.full(20, np.inf), np.full((20, len(state), 20), np.nan)
        kernels.advance(
            state,
            np.full((5, 20), 0.1),
            np.repeat(model.record, 20, axis=1),
            np.full((5, 20), np.inf),
            np.zeros(20),
            np.full((20, 5, 1), 0.1),
            grid,
            tables=model.tables,
            failed_at=failed,
            trace=trace,
        )
        return failed, trace

    (calm, expected), (failed, trace) = advance(tame), advance(wild)
    others = np.arange(20) != 4
    assert np.all(np.isinf(calm))
    assert failed[4] == pytest.approx(0.05)
    assert np.all(np.isinf(failed[others]))
    assert trace[:, :, others].tobytes() == expected[:, :, others].tobytes()
    assert wild[:, others].tobytes() == tame[:, others].tobytes()
    assert np.all(np.isfinite(trace))
    assert np.all(np.isfinite(wild))


def test_slew_limits_move_actuators_within_a_step():
    """With a slew limit the tail offset ramps: its rate enters the tail's velocity."""
    simulator = Simulator(swimmer(), 0.01)
    kernels, model = simulator.model.kernels, simulator.model
    grid, _ = time_grid(np.array([0.0, 0.1]), np.zeros(1), 0.01)
    state, inputs = InitialState().vector()[:, None].copy(), np.zeros((5, 1))
    kernels.advance(
        state,
        inputs,
        model.record,
        np.full((5, 1), 2.0),
        np.zeros(1),
        np.array([0.5, 0.0, 0.0, 0.0, 0.0])[None, :, None],
        grid,
        tables=model.tables,
        failed_at=np.full(1, np.inf),
    )
    np.testing.assert_allclose(inputs[:, 0], [0.2, 0.0, 0.0, 0.0, 0.0], atol=1e-15)
    still = simulator.wrench_by_term(state[:, 0], inputs[:, 0])["tail_drag"]
    ramping = simulator.wrench_by_term(
        state[:, 0], inputs[:, 0], input_rates=[2.0, 0.0, 0.0, 0.0, 0.0]
    )["tail_drag"]
    assert abs(ramping[1]) > abs(still[1])
