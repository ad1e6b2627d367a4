"""A campaign on several nodes, one killed in mid-run, equals diagnoses in one process."""

import json
import re
from pathlib import Path

import pytest

from fish_env.campaign import Options, find_cases, run_campaign
from fish_env.campaign.run import FAILED, FINISHED, MARK, TABLE
from fish_env.diagnosis import diagnose
from scripts import benchmark_diagnosis
from tests.cluster.machines import KillOnce, machines
from tests.diagnosis.small_cases import small_case

QUICK = Options(quick=True)
HIDDEN = ({}, {"servo_lag": 1.0}, {}, {"servo_lag": 1.0})


TIMES = re.compile(rb"\d{4}-\d\d-\d\dT[\d:.]+|\d+ s(?=\. Numbers: diagnosis\.json)")
LIST = ".robofish-files.json"


def contents(folder: Path) -> dict[str, bytes | str]:
    """Every file of a diagnosis without the dates in its pictures and the time it took.

    The campaign's mark is left out, and of the list of files, which has their checksums, all but
    that it is there.
    """
    found: dict[str, bytes | str] = {}
    for file in sorted(f for f in folder.rglob("*") if f.is_file() and f.name != MARK):
        content: bytes | str = TIMES.sub(b"", file.read_bytes())
        if file.name == "diagnosis.json":
            answer = json.loads(content)
            answer.pop("runtime_s")
            content = json.dumps(answer)
        found[str(file.relative_to(folder))] = b"" if file.name == LIST else content
    return found


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    place = tmp_path_factory.mktemp("data")
    for number, hidden in enumerate(HIDDEN):
        small_case(place / f"trial-{number}", hidden, runs=3, duration=4.0, seed=number)
    return place


@pytest.fixture(scope="module")
def alone(data, tmp_path_factory):
    """What one process makes of them."""
    place = tmp_path_factory.mktemp("alone")
    for number in range(len(HIDDEN)):
        diagnose(data / f"trial-{number}", place / f"trial-{number}", quick=True)
    return place


@pytest.fixture(scope="module")
def campaign(data, tmp_path_factory):
    """A campaign that lost a node after its first result, with a data set that is none."""
    (data / "broken").mkdir()
    (data / "broken" / "dataset.yaml").write_text("name: [")
    out = tmp_path_factory.mktemp("campaign")
    with machines() as cluster:
        kill = KillOnce(cluster)
        finished = lambda row: kill() if row.state == FINISHED else None  # noqa: E731
        rows = run_campaign(find_cases([str(data)]), out, QUICK, cluster.settings, finished)
    assert kill.calls == len(HIDDEN)
    return out, rows


def test_every_file_equals_that_of_one_process(campaign, alone):
    out, _ = campaign
    for number in range(len(HIDDEN)):
        name = f"trial-{number}"
        assert contents(out / name) == contents(alone / name)
    assert contents(out / "trial-0") != contents(alone / "trial-1"), "they can be told apart"


def test_a_data_set_that_cannot_be_read_is_a_row(campaign):
    out, rows = campaign
    assert [row.state for row in rows] == [FAILED, *[FINISHED] * len(HIDDEN)]
    assert "dataset.yaml" in rows[0].reason
    assert len((out / TABLE).read_text().splitlines()) == 1 + len(rows)


def test_a_suite_on_ray_equals_one_in_one_process(tmp_path):
    def run(name, *more):
        place = tmp_path / name
        benchmark_diagnosis.main(
            ["--tiers", "poor,null", "--limit", "4", "--diagnose",
             "tests.hidden.stubs:all_knowing", "--work", str(place), "--out", str(place), *more]
        )  # fmt: skip
        return {str(f.relative_to(place)): f.read_bytes() for f in place.rglob("*") if f.is_file()}

    assert run("ray", "--ray") == run("alone", "--processes", "1")
