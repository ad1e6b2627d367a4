"""Runs are divided whole, completely, without overlap, and the same way for a seed."""

from dataclasses import replace

import numpy as np
import pytest

from fish_env.data import CommandSteps, Dataset, Run, SteadyDataset, split_runs
from fish_env.errors import DatasetError


def dataset_of(conditions: list[str | None]) -> Dataset:
    commands = CommandSteps(np.zeros(1), np.zeros((1, 5)))
    samples = {"x": np.arange(2.0)}
    runs = [
        Run(f"r{i:02d}", np.arange(2.0), samples, commands, "rest", None, condition)
        for i, condition in enumerate(conditions)
    ]
    return Dataset("d", "zheng-2021-a", tuple(runs))


@pytest.mark.parametrize("count", [3, 4, 7, 29])
@pytest.mark.parametrize("seed", range(5))
def test_every_run_is_in_exactly_one_part(count, seed):
    dataset = dataset_of([None] * count)
    split = split_runs(dataset, seed)
    parts = [split.fit, split.select, split.final]
    assert sorted(sum(parts, ())) == list(dataset.ids)
    assert all(parts)
    for part, share in zip(parts, (0.5, 0.25, 0.25), strict=True):
        assert abs(len(part) - share * count) <= 1.0


def test_a_seed_decides():
    dataset = dataset_of([None] * 12)
    assert split_runs(dataset, 4) == split_runs(dataset, 4)
    assert len({split_runs(dataset, seed) for seed in range(10)}) > 5
    turned = replace(dataset, runs=dataset.runs[::-1])
    assert set(split_runs(turned, 4).final) == set(split_runs(dataset, 4).final)


def test_repeats_of_a_condition_stay_together():
    # r02 stands alone although a condition has its name.
    dataset = dataset_of(["A", "A", None, "B", "B", "B", "C", "r02", "r02"])
    for seed in range(20):
        split = split_runs(dataset, seed, by="condition")
        for part in (split.fit, split.select, split.final):
            for members in ({"r00", "r01"}, {"r03", "r04", "r05"}, {"r07", "r08"}):
                assert members <= set(part) or not members & set(part)


def test_rows_of_a_steady_table():
    table = SteadyDataset(
        "s", "f", tuple("abcd"), (None,) * 4, np.zeros((4, 5)), {"speed": np.ones(4)}
    )
    split = split_runs(table, 0, (0.5, 0.0, 0.5))
    assert (len(split.fit), len(split.select), len(split.final)) == (2, 0, 2)


def test_too_few_runs():
    with pytest.raises(DatasetError, match=r"2 run\(s\) cannot fill 3 parts"):
        split_runs(dataset_of([None, None]), 0)
    with pytest.raises(DatasetError, match="condition"):
        split_runs(dataset_of(["A"] * 9), 0, by="condition")


@pytest.mark.parametrize("fractions", [(0.5, 0.5, 0.5), (1.5, -0.5, 0.0), (0.5, 0.5)])
def test_impossible_fractions(fractions):
    with pytest.raises(DatasetError, match="sum to 1"):
        split_runs(dataset_of([None] * 9), 0, fractions)


def test_unknown_way_to_split():
    with pytest.raises(DatasetError, match="not by 'sample'"):
        split_runs(dataset_of([None] * 9), 0, by="sample")
