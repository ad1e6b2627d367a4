"""The benchmark measures what it says: in turn, with missing peers named and claims judged."""

import json
import shutil
import time

import numpy as np
import pytest

from scripts.bench import c_loop, harness, ours, random_actions, report, startup
from scripts.bench.harness import Contender, Measured, Missing


def fake(name: str, seconds: float = 0.0, envs: int = 1, threads: int = 1, log=None) -> Contender:
    def run(steps: int) -> None:
        if log is not None:
            log.append(name)
        time.sleep(seconds * steps)

    return Contender(name, envs, threads, 0.1, 10, "RK4", run)


def measured(name: str, rates, threads: int = 1) -> Measured:
    return Measured(fake(name, threads=threads), np.array(rates, float))


def test_contenders_are_timed_in_turn_and_back():
    log: list[str] = []
    contenders = [fake("a", 0.001, log=log), fake("b", 0.001, log=log)]
    harness.measure(contenders, rounds=2, seconds=0.005)
    assert log[-4:] == ["a", "b", "b", "a"]


def test_rate_counts_every_environment():
    (found,) = harness.measure([fake("many", 0.002, envs=50)], rounds=3, seconds=0.02)
    assert found.median == pytest.approx(50 / 0.002, rel=0.3)


def test_ratio_is_taken_within_rounds():
    """A round in which the machine was twice as slow for both changes nothing."""
    spread = harness.ratio(measured("ours", [8, 4, 8]), measured("theirs", [2, 1, 2]))
    assert (spread.low, spread.median, spread.high) == (4, 4, 4)


def test_missing_peer_is_reported():
    def absent() -> Contender:
        raise ImportError("No module named 'envpool'")

    ready, missing = harness.build([("here", lambda: fake("here")), ("EnvPool", absent)])
    assert [c.name for c in ready] == ["here"]
    assert missing == [Missing("EnvPool", "No module named 'envpool'")]
    page = report.markdown([measured("here", [1.0])], missing, {"date": "2026-01-01"})
    assert "| EnvPool | | missing: No module named 'envpool'" in page


RACE = [
    measured("RoboticFish3D-v0, gym.make", [100.0, 100.0]),
    measured("Gymnasium Swimmer-v5, gym.make", [20.0, 20.0]),
    measured("RoboticFish3D-v0, gym.make_vec 1024", [800.0, 800.0]),
    measured("RoboticFish3D-v0, gym.make_vec 1024", [900.0, 900.0], threads=2),
    measured("EnvPool FishSwim-v1, 64", [100.0, 100.0], threads=2),
    measured("EnvPool FishSwim-v1, 128", [200.0, 200.0], threads=2),
    measured("EnvPool FishSwim-v1, 64", [990.0, 990.0], threads=1),
]


def test_claims_are_judged_against_the_best_peer_on_as_many_threads():
    single, batch = report.judge(RACE)
    assert (single.word, single.spread.median) == ("met", 5.0)
    assert (batch.word, batch.spread.median) == ("missed", 4.5)
    assert batch.against == "EnvPool FishSwim-v1, 128"


def test_names_in_claims_are_those_of_contenders():
    """A claim about a contender that is called otherwise would never be measured."""
    made = {(c.name, c.threads) for c in (ours.single(), ours.vector(1024, 2))}
    assert made == {claim.ours for claim in report.CLAIMS}


def test_a_claim_without_its_peer_is_not_measured():
    assert [v.word for v in report.judge(RACE[:1])] == ["not measured"] * 2


def test_record_is_json_and_holds_every_round():
    found = json.loads(json.dumps(report.record(RACE, [], {"date": "2026-01-01"})))
    first = found["measured"][0]
    assert first["rounds_env_steps_per_s"] == [100.0, 100.0]
    assert (first["physics_substeps_per_s"], first["simulated_s_per_s"]) == (1000.0, 10.0)


@pytest.mark.parametrize(
    ("number", "text"), [(532.0, "532"), (25_600, "25.6k"), (1_310_000, "1.31M")]
)
def test_numbers_are_short(number, text):
    assert report.short(number) == text


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
@pytest.mark.parametrize("count", [1, 20])
def test_c_loop_swims_our_trajectories(count, tmp_path):
    case = c_loop.Case.of(count)
    own = c_loop.our_advance(case)
    library = c_loop.compile_loop(c_loop.PLAIN, 1 if count == 1 else 16, tmp_path)
    assert c_loop.disagreement(own, c_loop.c_advance(library, case), case) < c_loop.TOLERANCE
    other = c_loop.Case(case.state, case.commands, case.record * 1.0001)
    assert c_loop.disagreement(own, c_loop.c_advance(library, other), case) > c_loop.TOLERANCE


def test_what_is_not_finite_is_named():
    good = np.zeros(3)
    bad = np.array([0.0, np.nan, 0.0])
    assert random_actions.not_finite(good, good, {"power": good}) == []
    assert random_actions.not_finite(bad, good, {"power": bad}) == ["obs", "info power"]


def test_random_actions_count_how_episodes_end():
    ends = random_actions.swim(steps=8 * 401, envs=8, seed=0, quiet=True)
    assert ends.total() >= 8
    assert set(ends) <= {"time limit", *(f.name.lower() for f in random_actions.Failure)}


def test_start_up_program_reports_its_seconds_or_its_error():
    assert startup.run_program("print('noise'); print(0.25)") == 0.25
    with pytest.raises(RuntimeError, match="ModuleNotFoundError"):
        startup.run_program("import no_such_module")
