"""No command replaces a file that it reads, whatever that file is called or linked as."""

import json
import os
from pathlib import Path

import pytest
import yaml

from fish_env.data import dataset_files
from fish_env.diagnosis import diagnose
from fish_env.errors import OutputError
from fish_env.params import fish_files, load_fish
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies import shipped
from tests.command_line import run
from tests.fixtures.measured_data import good_folder, steady_folder

SUITE = load_suite("calm")
TABLE = "alpha_deg,C\n0,0.1\n30,0.5\n60,0.9\n90,1.1\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Everything that commands read, and links to some of it."""
    (tmp_path / "base.yaml").write_text("base: zheng-2021-a\nname: below\n")
    (tmp_path / "extended.yaml").write_text(
        "base: base.yaml\nname: mine\ntail: {drag: {table: extended.tail.drag.csv}}\n"
    )
    (tmp_path / "extended.tail.drag.csv").write_text(TABLE)
    good_folder(tmp_path / "runs", fish="../extended.yaml")
    steady_folder(tmp_path / "steady", fish="../extended.yaml")
    case = {"fish": "extended.yaml", "duration_s": 0.1, "schedule": [{"t": 0.0}]}
    (tmp_path / "case.json").write_text(json.dumps(case))
    (tmp_path / "path.csv").write_text("north,east,depth\n0,0,0.4\n1,0,0.4\n")
    (tmp_path / "policy.npz").write_bytes(shipped("hold")[0].read_bytes())
    environment = {"fish": str(tmp_path / "extended.yaml")}
    suite = {name: getattr(SUITE, name) for name in vars(SUITE)} | {"environment": environment}
    (tmp_path / "suite.yaml").write_text(yaml.safe_dump(suite))
    (tmp_path / "soft.html").symlink_to("case.json")
    (tmp_path / "soft.csv").symlink_to(tmp_path / "runs" / "r01.csv")
    os.link(tmp_path / "extended.yaml", tmp_path / "hard.yaml")
    os.link(tmp_path / "runs" / "r01.csv", tmp_path / "hard.csv")
    os.link(tmp_path / "policy.npz", tmp_path / "hard.json")
    return tmp_path


COMMANDS = {
    "simulate, case": "simulate {0}/case.json --replay {0}/case.json",
    "simulate, link": "simulate {0}/case.json --replay {0}/soft.html",
    "simulate, table": "simulate {0}/case.json --out {0}/extended.tail.drag.csv",
    "compare, description": "compare {0}/runs --json {0}/runs/dataset.yaml",
    "compare, run": "compare {0}/runs --json {0}/runs/r01.csv",
    "compare, link": "compare {0}/runs --replay {0}/soft.csv",
    "compare, fish": "compare {0}/steady --json {0}/extended.yaml",
    "compare, table": "compare {0}/steady --json {0}/steady/table.csv",
    "compare, base": "compare {0}/steady --json {0}/base.yaml",
    "compare, two outputs": "compare {0}/runs --json {0}/new.html --replay {0}/new.html",
    "replay, run": "replay {0}/runs/r01.csv --out {0}/runs/r01.csv",
    "replay, link": "replay {0}/runs/r01.csv --out {0}/hard.csv",
    "replay, description": "replay {0}/runs/r01.csv --out {0}/runs/dataset.yaml",
    "replay, case": "replay {0}/runs/r01.csv --case {0}/case.json --out {0}/case.json",
    "replay, fish": "replay {0}/runs/r01.csv --out {0}/hard.yaml",
    "fit, fish": "fit {0}/runs --out {0}/extended.yaml",
    "fit, link": "fit {0}/runs --out {0}/hard.yaml",
    "diagnose, fish": "diagnose {0}/runs --out {0}",
    "diagnose steady, fish": "diagnose {0}/steady --out {0}",
    "evaluate, suite": "evaluate --agent pid --suite {0}/suite.yaml --json {0}/suite.yaml",
    "evaluate, policy": "evaluate --agent {0}/policy.npz --suite calm --json {0}/hard.json",
    "evaluate, fish": "evaluate --agent pid --suite {0}/suite.yaml --json {0}/extended.yaml",
    "swim, path": "swim --path {0}/path.csv --out {0}/out --replay {0}/path.csv",
    "swim, policy": "swim --agent {0}/policy.npz --out {0}/out --replay {0}/policy.npz",
}


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_replaces_what_it_reads(command, folder, capsys, monkeypatch):
    for module in ("fish_env.diagnosis.pipeline", "fish_env.commands.fit"):
        monkeypatch.setattr(f"{module}.check_runs", lambda dataset: None)
    before = contents(folder)
    status, _, error = run(capsys, *COMMANDS[command].format(folder).split())
    assert status == 2
    assert "give the output another name" in error or "give one another name" in error
    assert "Traceback" not in error
    assert contents(folder) == before


def test_a_diagnosis_from_python_is_refused_too(folder):
    before = contents(folder)
    with pytest.raises(OutputError, match=r"extended\.yaml: is read"):
        diagnose(folder / "runs", out=folder)
    assert contents(folder) == before


def test_outputs_that_are_no_inputs_pass(folder, capsys):
    words = ["simulate", str(folder / "case.json"), "--out", str(folder / "swim.csv")]
    assert run(capsys, *words)[0] == 0
    out = str(folder / "swim.csv")
    assert run(capsys, "replay", out, "--out", str(folder / "swim.html"))[0] == 0


def test_every_file_behind_a_fish_is_known(folder):
    (folder / "extended.yaml").write_text(
        (folder / "extended.yaml").read_text() + "effects: {cable: {size: 1.0}}\n"
    )
    names = [file.name for file in fish_files(folder / "extended.yaml")]
    shipped_fish = load_fish("zheng-2021-a").source_file.name
    assert names == [
        "extended.yaml", "extended.tail.drag.csv", "cable.py", "base.yaml", shipped_fish,
    ]  # fmt: skip


def test_every_file_behind_a_dataset_is_known(folder):
    assert [file.name for file in dataset_files(folder / "runs")] == ["dataset.yaml", "r01.csv"]
    assert [file.name for file in dataset_files(folder / "steady")] == ["dataset.yaml", "table.csv"]
