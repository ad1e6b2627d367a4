"""The soak, shortened: nothing grows, every number is finite, and what grows is noticed."""

import json
import signal
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from fish_env.envs.options import env_options
from scripts.reliability import soak_batch, soak_runs, turns, watch, widest
from scripts.reliability.soak import main


def test_the_widest_draws_are_legal_and_wider_ones_are_not():
    ranges = widest.bounds()
    assert widest.accepted(widest.swimmable())
    assert widest.accepted(widest.with_effects())
    assert {path.split(".")[0] for path in ranges} >= {"effects", "body", "tail", "inertia"}
    path = "inertia.rest[0]"
    low, high = ranges[path]
    assert widest.accepted({path: [low, high]})
    assert not widest.accepted({path: [low, 4 * high]})


def test_the_draws_that_swim_hardly_divide_the_step():
    """One new effect divided it by 18, and a soak of minutes took hours."""
    usual = env_options(**widest.DEEP).config.substeps
    drawn = env_options(randomization=widest.with_effects(), **widest.DEEP).config.substeps
    assert drawn <= 2 * usual


@pytest.mark.slow
def test_the_batch_stays_finite_under_the_widest_draws(monkeypatch):
    monkeypatch.setattr(soak_batch, "BLOCK", 10)
    result = soak_batch.soak(60_000, envs=128)
    assert result["steps"] >= 60_000
    assert set(result["steps_by_draws"]) == {"lean", "effects", "bounds"}
    assert result["ends"]["bounds"]["diverged"] > 0
    for cost in result["denormals"].values():
        assert cost["median_time_ratio"] < 5.0


def test_denormals_reach_the_state():
    """The blocks are what they say: the velocities begin below the smallest normal number."""
    swimmers = soak_batch.make("lean", 4)
    swimmers.env.reset(seed=0, options=soak_batch.start_of("denormal"))
    rates = np.abs(swimmers.env.batch.state[7:13])
    assert np.all((rates > 0) & (rates < np.finfo(float).tiny))


class Broken:
    """A batch whose observations hold a number that is not finite."""

    def __init__(self, env):
        self.env, self.num_envs, self.batch = env, env.num_envs, env.batch

    def step(self, actions):
        obs, *rest = self.env.step(actions)
        obs[0, 0] = np.nan
        return obs, *rest


def test_a_number_that_is_not_finite_ends_the_soak():
    swimmers = soak_batch.make("lean", 4)
    swimmers.env.reset(seed=0)
    broken = replace(swimmers, env=Broken(swimmers.env))
    with pytest.raises(ValueError, match="not finite"):
        soak_batch.swim_block(broken, "random", np.random.default_rng(0), Counter())


def sample(i, memory=100.0, files=10, threads=1, left=0):
    return watch.Sample(60.0 * i, memory, files, threads, left)


def test_growth_is_noticed_and_noise_is_not():
    noise = np.random.default_rng(0).uniform(-1.0, 1.0, 60)
    steady = [sample(i, 100.0 + noise[i]) for i in range(60)]
    assert watch.growth(steady) == []
    warming = [sample(i, min(60.0 + 10 * i, 100.0) + noise[i]) for i in range(60)]
    assert watch.growth(warming) == []
    assert "memory" in watch.growth([sample(i, 100.0 + 0.2 * i + noise[i]) for i in range(60)])[0]
    assert "open files" in watch.growth([sample(i, files=10 + i // 10) for i in range(60)])[0]
    assert "threads" in watch.growth([sample(i, threads=1 + i // 20) for i in range(60)])[0]
    assert "files left" in watch.growth([sample(i, left=i // 20) for i in range(60)])[0]
    assert watch.growth([sample(0), sample(1)]) == ["too few samples to tell"]


def test_a_turn_that_leaks_is_noticed(tmp_path):
    """A list that grows, a file that stays open and one that is left are found by real samples."""
    kept = []

    def leak(folder, data):
        # Far more than the process may give back meanwhile of what earlier tests used.
        kept.append((np.ones(5_000_000), (data / "dataset.yaml").open()))
        (folder.parent / f"left-{len(kept)}").write_text("x")
        time.sleep(0.05)

    result = turns.take_turns(tmp_path, 0.6, turn=leak)
    for _, stream in kept:
        stream.close()
    grew = " ".join(result["resources"]["grew"])
    assert "memory" in grew
    assert "open files" in grew
    assert "files left" in grew


@pytest.mark.slow
def test_train_evaluate_and_diagnose_in_turn_leave_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(turns, "LEAST_TURNS", 3)
    result = turns.take_turns(tmp_path, 0.0)
    assert result["turns"] == 3
    last = result["resources"]["last"]
    assert last["open_files"] <= result["resources"]["first"]["open_files"]
    assert last["files"] == result["resources"]["first"]["files"]


def test_the_command_writes_a_dated_result(tmp_path):
    with pytest.raises(SystemExit):
        main(["--only", "batch", "--steps", "1", "--envs", "2", "--out", str(tmp_path)])
    assert [file.name.startswith("soak-batch-") for file in tmp_path.iterdir()] == [True]


def test_runs_of_one_day_are_kept_and_added_up(tmp_path, capsys):
    command = ["--only", "batch", "--envs", "2", "--out", str(tmp_path)]
    for steps in ("1", "1"):
        with pytest.raises(SystemExit):
            main([*command, "--steps", steps])
    first, second = soak_runs.results_of("batch", tmp_path)
    runs = [json.loads(file.read_text()) for file in (first, second)]
    assert [run["seed"] for run in runs] == [0, 1]
    capsys.readouterr()
    main([*command, "--sum"])
    *each, total = capsys.readouterr().out.splitlines()
    assert total == f"batch: {sum(run['steps'] for run in runs):,} steps in 2 runs"
    assert [line.partition(":")[0] for line in each] == [first.name, second.name]
    assert all("MB an hour" in line for line in each)


def test_a_run_that_is_asked_to_end_has_a_result(tmp_path):
    def stop(folder, data):
        signal.raise_signal(signal.SIGTERM)

    with soak_runs.until_stopped() as stopped:
        result = turns.take_turns(tmp_path, 3600.0, turn=stop, stopped=stopped)
    assert result["turns"] == 1
    assert result["resources"]["grew"] == ["too few samples to tell"]
