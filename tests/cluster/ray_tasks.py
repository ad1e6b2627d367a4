"""Tasks on Ray: each result once, whatever dies. Needs the extra `ray`."""

import time

import pytest
import ray as ray_module

from fish_env.cluster import ClusterSettings, Failed, Task, connected, run_tasks
from fish_env.cluster.tasks import WrongVersion
from fish_env.errors import ConfigError
from tests.cluster import works
from tests.cluster.machines import machines

NUMBERS = range(6)


def tasks(folder, seconds=0.0, numbers=NUMBERS):
    return [Task(str(n), works.Asked(n, str(folder), seconds)) for n in numbers]


def squares(numbers=NUMBERS):
    return {str(n): n**2 for n in numbers}


@pytest.fixture(scope="module")
def ray():
    with connected(ClusterSettings(cpus=2)) as found:
        yield found


def results(ray, function, todo, **options):
    return {task.name: found for task, found in run_tasks(ray, function, todo, **options)}


def test_each_task_runs_once(ray, tmp_path):
    assert results(ray, works.square, tasks(tmp_path)) == squares()
    assert [works.attempts(tmp_path, n) for n in NUMBERS] == [1] * len(NUMBERS)


def test_tasks_are_read_as_cores_get_free(ray, tmp_path):
    read = []

    def given():
        for task in tasks(tmp_path, numbers=range(30)):
            read.append(task)
            yield task

    first = next(run_tasks(ray, works.square, given()))
    assert first[1] == int(first[0].name) ** 2
    assert len(read) < 10


def test_a_task_whose_process_died_runs_again(ray, tmp_path):
    assert results(ray, works.dies_once, tasks(tmp_path)) == squares()
    assert [works.attempts(tmp_path, n) for n in NUMBERS] == [2] * len(NUMBERS)


def test_without_retries_the_same_death_is_a_failure(ray, tmp_path):
    """What the test above would see if nothing ran again."""
    found = results(ray, works.dies_once, tasks(tmp_path), retries=0)
    assert all(isinstance(result, Failed) for result in found.values())


def test_a_task_that_always_kills_its_process_is_given_up_and_the_rest_is_done(ray, tmp_path):
    found = results(ray, works.dies_always_at_three, tasks(tmp_path), retries=2)
    assert "died each time" in found.pop("3").reason
    assert found == {name: value for name, value in squares().items() if name != "3"}
    assert works.attempts(tmp_path, 3) == 3


def test_an_error_is_one_line_and_is_not_tried_again(ray, tmp_path):
    found = results(ray, works.refuses_three, tasks(tmp_path))
    assert found["3"] == Failed("three: is no data set; drop it")
    assert works.attempts(tmp_path, 3) == 1


def test_another_version_is_refused_by_name(ray, tmp_path, monkeypatch):
    monkeypatch.setattr("fish_env.cluster.tasks.VERSION", "0.0.1")
    with pytest.raises(WrongVersion, match=r"the command 0\.0\.1.*Install the same version"):
        results(ray, works.square, tasks(tmp_path))


def test_a_killed_node_loses_no_task(ray, tmp_path):
    ray_module.shutdown()
    with machines() as cluster, connected(cluster.settings) as joined:
        found = {}
        for task, result in run_tasks(joined, works.square, tasks(tmp_path, 1.0)):
            found[task.name] = result
            if len(found) == 1:
                time.sleep(0.3)  # the next ones run
                cluster.kill_one()
        assert found == squares()
        assert cluster.alive == 1
        repeated = [n for n in NUMBERS if works.attempts(tmp_path, n) > 1]
        assert repeated, "the node died without work on it"


def test_no_cluster_at_the_address_is_one_line():
    ray_module.shutdown()
    wrong = ClusterSettings(address="127.0.0.1:1")
    with pytest.raises(ConfigError, match="no Ray cluster answers") as found, connected(wrong):
        pass
    assert "\n" not in str(found.value)
