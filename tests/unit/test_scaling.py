"""The simulation of a campaign on many cores agrees with what can be worked out by hand."""

from dataclasses import replace

import pytest

from scripts.reliability.scaling import Costs, simulate

FREE = Costs(10.0, 0.0, 0.0, 0.0, 0, 0, 0.0)


@pytest.mark.parametrize("cores", [1, 2, 100])
def test_without_overhead_cores_are_used_in_full(cores):
    found = simulate(FREE, cores, 10 * cores)
    assert found.wall_s == pytest.approx(100.0)
    assert found.efficiency == pytest.approx(1.0)


def test_one_core_adds_up():
    costs = replace(FREE, prepare_s=1.0, hand_out_s=0.5, keep_s=0.25, compile_s=7.0, start_s=2.0)
    assert simulate(costs, 1, 4).wall_s == pytest.approx(9.0 + 4 * 11.5 + 0.25 * 4)
    assert simulate(costs, 1, 4, cached=True).wall_s == pytest.approx(2.0 + 4 * 11.5 + 0.25 * 4)


def test_many_cores_wait_for_the_one_process():
    """At 0.1 s a task it cannot feed more than 100 cores with tasks of 10 s."""
    costs = replace(FREE, prepare_s=0.06, keep_s=0.04)
    found = simulate(costs, 1000, 10_000)
    assert found.driver > 0.98
    assert found.efficiency == pytest.approx(0.1, rel=0.03)


def test_bytes_take_the_time_of_the_network():
    costs = replace(FREE, task_bytes=10**6, result_bytes=10**6, bytes_per_s=2e7)
    assert simulate(costs, 1000, 10_000).wall_s == pytest.approx(1000.0, rel=0.02)
