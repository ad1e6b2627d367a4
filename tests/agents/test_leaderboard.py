"""The leaderboard orders agents, names what is not measured, and is what the README shows."""

import json

import pytest
from typer.testing import CliRunner

from fish_env import cli
from fish_env.envs.registration import ENV_ID
from fish_env.errors import ConfigError
from robofish_agents.evaluation.intervals import Interval
from robofish_agents.evaluation.labels import LABELS
from robofish_agents.evaluation.leaderboard import MISSING, SHIPPED, by_metric, overview
from robofish_agents.evaluation.metrics import STEP_METRICS
from robofish_agents.evaluation.results import Result, read_results, write_results
from robofish_agents.evaluation.suites import load_suite, suite_names
from scripts import agents_report, benchmark_agents


def result(agent: str, suite: str, task: str, level: float, seeds: int = 1) -> Result:
    metrics = {
        name: None
        if name in STEP_METRICS and task == "track"
        else Interval(level, 0.9 * level, 1.1 * level)
        for name in LABELS
    }
    return Result(agent, suite, 1, task, ENV_ID, seeds, 100, metrics)


RESULTS = [
    result("pid", "hard", "hold", 0.5),
    result("learned", "calm", "hold", 1.0, seeds=5),
    result("pid", "calm", "hold", 0.25),
    result("pid", "calm", "track", 0.125),
]


def test_suites_go_from_easy_to_hard_and_the_best_return_comes_first():
    assert overview(RESULTS).splitlines() == [
        "| task | agent | calm | hard |",
        "| --- | --- | --- | --- |",
        f"| hold | learned, 5 seeds | 100 %, 100 cm, 57.3°, 1000 mW | {MISSING} |",
        "| hold | pid | 25 %, 25.0 cm, 14.3°, 250 mW | 50 %, 50.0 cm, 28.6°, 500 mW |",
        f"| track | pid | 12.5 %, 12.5 cm, 7.16°, 125 mW | {MISSING} |",
    ]


def test_one_metric_comes_with_its_intervals():
    table = by_metric(RESULTS, "depth_overshoot")
    assert "| hold | pid | 25.0 (22.5 to 27.5) | 50.0 (45.0 to 55.0) |" in table
    assert f"| track | pid | - | {MISSING} |" in table
    with pytest.raises(ConfigError, match="metric 'luck': one of success_rate"):
        by_metric(RESULTS, "luck")


def test_paths_and_places_have_tables_of_their_own():
    own = {
        "path": ("path/helix", ("cross_track_rmse_m", "depth_rmse_m")),
        "station": ("station/waves", ("place_rmse_m", "place_late_rmse_m")),
    }
    rows = list(RESULTS)
    for task, (suite, names) in own.items():
        half = Interval(0.5, 0.4, 0.6)
        metrics = dict.fromkeys(("success_rate", "mean_power_w", "episode_return", *names), half)
        rows.append(Result("pid", suite, 1, task, "any", 1, 4, metrics))
    first, path, station = overview(rows).split("\n\n")
    assert first == overview(RESULTS)
    assert path.splitlines()[-1] == "| path | pid | 50 %, 50.0 cm, 50.0 cm, 500 mW |"
    assert station.splitlines()[0] == "| task | agent | station/waves |"
    assert by_metric(rows, "place_rmse_m").splitlines()[-1].startswith("| station | pid | 50.0")
    assert "path" not in by_metric(rows, "place_rmse_m")


def test_the_command_prints_the_table_of_the_readme_and_what_is_added(tmp_path):
    mine = tmp_path / "mine.json"
    write_results(mine, [result("mine", "calm", "hold", 0.5)])
    printed = CliRunner().invoke(cli.app, ["leaderboard"]).output
    assert printed.strip() == overview(read_results(SHIPPED))
    assert printed.strip() in (agents_report.ROOT / "README.md").read_text(encoding="utf-8")
    more = CliRunner().invoke(cli.app, ["leaderboard", "--add", str(mine)]).output
    assert "| hold | mine | 50 %," in more


def test_the_shipped_results_are_of_the_suites_as_they_are():
    results = read_results(SHIPPED)
    suites = {name: load_suite(name) for name in suite_names()}
    of_now = {name: suite.version for name, suite in suites.items()}
    assert all(r.suite_version == of_now[r.suite] and r.episodes == 100 for r in results)
    for agent in {r.agent for r in results}:
        measured = {(r.suite, r.task) for r in results if r.agent == agent}
        assert measured == {(name, task) for name, suite in suites.items() for task in suite.tasks}


def test_the_shipped_results_are_of_the_agents_as_they_are():
    measured = json.loads(SHIPPED.read_text(encoding="utf-8"))["fingerprints"]
    assert measured == benchmark_agents.fingerprints(list(measured)), "run make benchmark-agents"
    assert set(measured) == {r.agent for r in read_results(SHIPPED)}


def test_a_fingerprint_changes_with_the_agent(monkeypatch):
    before = benchmark_agents.fingerprint("pid", "calm")
    assert before != benchmark_agents.fingerprint("pid", "hard")
    places = (*benchmark_agents.SOURCES["pid"], "pyproject.toml")
    monkeypatch.setitem(benchmark_agents.SOURCES, "pid", places)
    assert before != benchmark_agents.fingerprint("pid", "calm")


def test_a_reworded_docstring_is_the_same_agent(tmp_path):
    code = 'def act(x):\n    """{}"""\n    return {} * x\n'
    files = [tmp_path / f"{i}.py" for i in range(3)]
    for file, filled in zip(
        files, (("Acts.", 2), ("Returns actions.", 2), ("Acts.", 3)), strict=True
    ):
        file.write_text(code.format(*filled))
    one, reworded, other = map(benchmark_agents.content, files)
    assert one == reworded
    assert one != other


def test_without_results_the_pages_say_so(tmp_path):
    none = tmp_path / "none.json"
    assert agents_report.headline(none) == agents_report.NOT_YET
    assert agents_report.NOT_YET in agents_report.section(none)


def test_the_section_has_every_metric_and_the_times(tmp_path):
    file = tmp_path / "results.json"
    times = {"pid": {f"{c}_ms_{q}": 0.1234 for c in ("wall", "process") for q in ("median", "p99")}}
    machine = {"cores": 2, "cpu": "a CPU"}
    write_results(file, RESULTS, date="2026-01-02", machine=machine, decision_times=times)
    assert json.loads(file.read_text())["date"] == "2026-01-02"
    text = agents_report.section(file)
    assert "| pid | 0.123 | 0.123 | 0.123 | 0.123 |" in text
    assert all(f"### {label[0].upper()}{label[1:]}" in text for label, _ in LABELS.values())
