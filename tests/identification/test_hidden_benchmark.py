"""The benchmark of the hidden suites goes on where it stopped."""

import importlib.util
import json
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def benchmark():
    spec = importlib.util.spec_from_file_location(
        "benchmark_diagnosis", ROOT / "scripts" / "benchmark_diagnosis.py"
    )
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


def test_the_benchmark_goes_on_where_it_stopped(benchmark, tmp_path, capsys):
    options = ["--tiers", "poor,null", "--limit", "2", "--processes", "1"]
    options += ["--work", str(tmp_path / "work"), "--out", str(tmp_path / "results")]
    benchmark.main([*options, "--diagnose", "tests.hidden.stubs:all_knowing"])
    finished = {file: file.stat().st_mtime_ns for file in (tmp_path / "work/full").iterdir()}
    benchmark.main([*options, "--diagnose", "tests.hidden.stubs:not_there"])
    assert {file: file.stat().st_mtime_ns for file in finished} == finished
    (result,) = (tmp_path / "results").glob("diagnosis-*.json")
    assert json.loads(result.read_text())["overall"]["name_right"]["count"] == 2
    assert "100 %" in capsys.readouterr().out
    benchmark.main([*options, "--fresh", "--diagnose", "tests.hidden.stubs:not_there"])
    assert json.loads(result.read_text())["overall"]["failed"]["count"] == 2


def test_the_benchmark_goes_on_after_a_published_part_of_its_own_commit(benchmark, tmp_path):
    options = ["--tiers", "poor,null", "--processes", "1"]
    begun = [*options, "--limit", "1", "--work", str(tmp_path / "a"), "--out", str(tmp_path / "r")]
    benchmark.main([*begun, "--diagnose", "tests.hidden.stubs:all_knowing"])
    (part,) = (tmp_path / "r").glob("diagnosis-*.json")
    whole = [*options, "--limit", "2", "--work", str(tmp_path / "b"), "--out", str(tmp_path / "s")]
    whole += ["--diagnose", "tests.hidden.stubs:not_there", "--after", str(part)]
    benchmark.main(whole)
    (result,) = (tmp_path / "s").glob("diagnosis-*.json")
    overall = json.loads(result.read_text())["overall"]
    assert (overall["name_right"]["count"], overall["failed"]["count"]) == (1, 1)
    part.write_text(json.dumps({**json.loads(part.read_text()), "commit": "0000000"}))
    with pytest.raises(SystemExit, match="made at 0000000"):
        benchmark.main(whole)
