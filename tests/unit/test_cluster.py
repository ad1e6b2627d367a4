"""What campaigns and sweeps do before a cluster is needed: plans, names, refusals."""

import subprocess
import sys

import pytest

from fish_env.campaign import Options, find_cases, run_campaign
from fish_env.campaign.cases import prepare
from fish_env.campaign.run import FAILED, FINISHED, MARK
from fish_env.cluster import ClusterSettings
from fish_env.data import load_dataset, write_dataset
from fish_env.errors import ConfigError, DatasetError, OutputError
from fish_env.files import write_text
from robofish_agents.sweep.plan import plan
from tests.command_line import run

DEMO = "demo-trials"


@pytest.fixture
def data(tmp_path):
    for name in ("a/pool", "b/pool", "b/sea"):
        write_dataset(load_dataset(DEMO), tmp_path / name)
    return tmp_path


def names(*patterns):
    return [case.name for case in find_cases([str(pattern) for pattern in patterns])]


def test_folders_patterns_and_names_mean_data_sets_once_each(data):
    assert names(data / "b/sea") == ["sea"]
    assert names(data / "b") == ["pool", "sea"]
    assert names(data / "b/*", data / "b/sea") == ["pool", "sea"]
    assert names(data / "**") == ["a-pool", "b-pool", "sea"]
    assert names(DEMO) == [DEMO]


@pytest.mark.parametrize("pattern", ["nowhere", "no/*/where", "."])
def test_a_pattern_without_data_is_refused(tmp_path, monkeypatch, pattern):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DatasetError, match=r"no folder with dataset\.yaml"):
        find_cases([pattern])


def finish(case, out, options, row=None):
    """Puts the mark of a finished case where a campaign puts it."""
    digest = prepare(case, options, out / case.name).digest
    row = row or f'{{"name": "{case.name}", "source": "", "state": "{FINISHED}"' + (
        ', "verdict": "no_misfit", "causes": "", "runtime_s": 1.0, "reason": ""}'
    )
    write_text(out / case.name / MARK, f'{{"digest": "{digest}", "row": {row}}}')


def test_what_is_finished_is_read_back_without_a_cluster(data, tmp_path):
    cases, out = find_cases([str(data / "b")]), tmp_path / "out"
    for case in cases:
        finish(case, out, Options())
    nowhere = ClusterSettings(address="127.0.0.1:1")
    rows = run_campaign(cases, out, Options(), nowhere)
    assert [(row.name, row.state) for row in rows] == [("pool", FINISHED), ("sea", FINISHED)]


@pytest.mark.parametrize("other", [Options(quick=True), Options(patient=True), Options(seed=1)])
def test_results_of_other_options_or_data_stay_and_are_a_refusal(data, tmp_path, other):
    (case,), out = find_cases([str(data / "b/sea")]), tmp_path / "out"
    finish(case, out, other)
    mark = (out / "sea" / MARK).read_bytes()
    with pytest.raises(OutputError, match="other data, another fish or with other options"):
        run_campaign([case], out, Options(), ClusterSettings())
    with (data / "b/sea/dataset.yaml").open("a") as stream:
        stream.write("# changed\n")
    with pytest.raises(OutputError, match="other data"):
        run_campaign([case], out, other, ClusterSettings())
    assert (out / "sea" / MARK).read_bytes() == mark


def test_a_damaged_mark_is_a_refusal(data, tmp_path):
    (case,), out = find_cases([str(data / "b/sea")]), tmp_path / "out"
    finish(case, out, Options(), row="3")
    with pytest.raises(OutputError, match="no mark of a finished case"):
        run_campaign([case], out, Options(), ClusterSettings())


def test_data_that_cannot_be_read_are_a_row(tmp_path):
    write_text(tmp_path / "data" / "dataset.yaml", "name: [")
    cases = find_cases([str(tmp_path / "data")])
    (row,) = run_campaign(cases, tmp_path / "out", Options(), ClusterSettings())
    assert row.state == FAILED
    assert "dataset.yaml" in row.reason


def test_a_sweep_is_all_combinations():
    trials = plan("ppo-hold", "0-1,7", ["ppo.gamma=0.9,0.95", "network.layers=[8, 8],[16]"])
    assert len(trials) == len({trial.name for trial in trials}) == 12
    last = trials[-1]
    assert (last.config.seed, last.config.ppo.gamma, last.config.network.layers) == (7, 0.95, (16,))
    assert last.name == "ppo-hold-ppo.gamma=0.95-network.layers=[16]-seed-7"
    assert plan("ppo-hold")[0].config.ppo.gamma == 0.98


@pytest.mark.parametrize(
    ("seeds", "settings", "said"),
    [
        ("0;1", [], "--seeds"),
        ("3-1", [], "--seeds"),
        ("0,0", [], "twice"),
        ("", ["ppo.gamma"], "KEY=VALUE"),
        ("", ["ppo.gama=0.9"], "unknown key 'gama'"),
        ("", ["ppo.gamma=2.0"], "gamma"),
        ("", ["ppo.gamma=high"], "finite number"),
        ("", ["ppo.gamma=0.9,0.9"], "twice"),
        ("", ["ppo.gamma=0.9", "ppo.gamma=0.95"], "given twice"),
        ("", ["ppo.gamma.start=0.9"], "nothing below"),
        ("", ["ppo.gamma=[0.9"], "ppo.gamma"),
        ("", ["seed=1,2"], "--seeds"),
        ("", ["trust_effects=true"], "not a setting"),
        ("0-999999", ["ppo.gamma=0.9,0.95"], "more than"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused_by_name(seeds, settings, said):
    with pytest.raises(ConfigError, match=said) as found:
        plan("ppo-hold", seeds, settings)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("option", [("--cpus", "2"), ("--temp", "here")])
def test_an_address_goes_with_no_option_of_this_machine(capsys, option):
    line = ("campaign", DEMO, "--out", "x", "--address", "auto", *option)
    status, _, err = run(capsys, *line)
    assert status == 2
    assert "--cpus and --temp apply only to a cluster on this machine" in err


MISSING = """
import sys
sys.modules["ray"] = None  # what an import meets where it is not installed
from fish_env.cli import main
sys.argv = ["robofish", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize("command", [("campaign", DEMO), ("sweep", "ppo-hold")])
def test_without_ray_one_line_says_what_to_install(tmp_path, command):
    result = subprocess.run(
        [sys.executable, "-c", MISSING, *command, "--out", str(tmp_path / "out")],
        capture_output=True, text=True,
    )  # fmt: skip
    assert result.returncode == 2
    said = result.stderr.strip().splitlines()[-1]
    assert "needs the package 'ray'" in said
    assert 'pip install "' in said or "pip install ray" in said
    assert "Traceback" not in result.stderr
