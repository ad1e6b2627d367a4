"""The outcomes of tests that pytest reports."""

from scripts.junit import outcomes
from scripts.record_clients import counted


def test_the_outcome_of_every_cluster_test_is_kept(tmp_path):
    report = tmp_path / "report.xml"
    report.write_text(
        '<testsuites><testsuite><testcase classname="tests.cluster.ray_tasks" name="runs" '
        'time="1.234"/><testcase classname="tests.cluster.ray_tasks" name="fails" time="0.5">'
        '<failure message="wrong"/></testcase></testsuite></testsuites>'
    )
    assert outcomes(report) == [
        {"test": "ray_tasks::runs", "outcome": "passed", "seconds": 1.23},
        {"test": "ray_tasks::fails", "outcome": "failure", "seconds": 0.5},
    ]
    assert counted(outcomes(report)) == ({"ray_tasks": {"passed": 1, "failure": 1}}, 1.7)
