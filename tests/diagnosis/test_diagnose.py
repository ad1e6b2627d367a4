"""`diagnose` from folder to files: it finds what is hidden, and nothing where nothing is."""

import io
import json
import warnings

import pytest
from rich.console import Console

from fish_env.cli import main
from fish_env.commands.diagnose import diagnose_dataset, print_headline
from fish_env.diagnosis import diagnose
from fish_env.diagnosis.answer import FORMAT
from fish_env.diagnosis.headline import headline
from fish_env.diagnosis.policy import policies_as_dict
from fish_env.diagnosis.writing import write_answer
from fish_env.inference.verdict import VERDICTS
from fish_env.params import load_fish
from fish_env.simulator import Simulator
from tests.diagnosis.small_cases import small_case
from tests.fixtures.measured_data import good_folder, steady_folder

KEYS = {
    "format", "dataset", "fish", "seed", "runtime_s", "verdict", "causes", "alternatives",
    "parameters", "misfit", "gain", "preconditions", "next_experiment",
}  # fmt: skip


@pytest.fixture(scope="module")
def lagging(tmp_path_factory):
    """A fish whose servo lags, diagnosed from the command line: truth, folder, what was shown."""
    folder = tmp_path_factory.mktemp("lagging")
    truth = small_case(folder / "data", {"servo_lag": 1.0}, runs=4, duration=8.0)
    shown = io.StringIO()
    console = Console(file=shown, width=120)
    with warnings.catch_warnings():
        # The final run may leave the range of the others, which is no news to who asks why.
        warnings.filterwarnings("error", message=".*do not cover")
        diagnose_dataset(console, str(folder / "data"), folder / "out", None, True, 0)
    return truth, folder / "out", shown.getvalue()


@pytest.mark.slow
def test_a_hidden_effect_is_named_with_its_size(lagging):
    truth, out, shown = lagging
    answer = json.loads((out / "diagnosis.json").read_text())
    assert answer["format"] == FORMAT
    assert set(answer) >= KEYS
    assert answer["policy"] == policies_as_dict()
    assert answer["verdict"] == "cause"
    assert [cause["name"] for cause in answer["causes"]] == ["servo_lag"]
    found = answer["causes"][0]["parameters"]["time_constant"]
    true = truth.effects["servo_lag"]["time_constant"]
    assert found["estimate"] == pytest.approx(true, rel=0.05)
    assert found["ci95"][0] < found["estimate"] < found["ci95"][1]
    assert "The simulation lacks servo_lag" in " ".join(shown.split())


@pytest.mark.slow
def test_the_gain_is_measured_on_a_run_that_was_not_fitted(lagging):
    answer = json.loads((lagging[1] / "diagnosis.json").read_text())
    gain = answer["gain"]
    assert len(gain["final_runs"]) == 1
    assert gain["fit_percent"]["extended"] > gain["fit_percent"]["baseline"] + 5
    assert gain["share_of_reachable"]["estimate"] > 0.9
    assert answer["misfit"]["r"]["baseline"] > 2 * answer["misfit"]["r"]["extended"]


@pytest.mark.slow
def test_the_extended_model_swims(lagging):
    fish = load_fish(lagging[1] / "extended.yaml")
    assert fish.effects["servo_lag"]["time_constant"] > 0.02
    assert "effects.servo_lag.time_constant" in fish.posterior.names
    assert fish.posterior.validity["ranges"]["tail_frequency"][1] > 1.0
    schedule = [{"t": 0.0, "tail_amplitude": 0.4, "tail_frequency": 1.5}]
    assert Simulator(fish).run(schedule, duration_s=1.0).states[-1, 0] > 0.0


@pytest.mark.slow
def test_nothing_is_found_where_nothing_is_hidden(tmp_path):
    small_case(tmp_path / "data", {}, runs=3, duration=8.0)
    out = tmp_path / "out"
    write_answer({"format": FORMAT}, load_fish("zheng-2021-a"), out)  # of an earlier diagnosis
    steps = []
    answer = diagnose(tmp_path / "data", out=out, quick=True, progress=steps.append)
    assert answer["verdict"] in ("no_misfit", "not_excited")
    assert answer["causes"] == []
    assert answer["gain"] is None
    assert "20 s of two runs" in answer["left_out"][0]
    assert not (out / "extended.yaml").exists()
    assert max(pair["extended"] for pair in answer["misfit"].values()) < 1.2
    assert {"refitting the baseline", "screening causes", "testing the residual"} <= set(steps)


@pytest.mark.parametrize("make", [good_folder, steady_folder])
def test_refused_input_is_one_line_and_status_two(make, tmp_path, monkeypatch, capsys):
    folder = make(tmp_path / "data")
    out = str(tmp_path / "out")
    monkeypatch.setattr("sys.argv", ["robofish", "diagnose", str(folder), "--out", out])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    shown = capsys.readouterr().err
    assert shown.startswith("robofish: ")
    assert "Traceback" not in shown
    assert not (tmp_path / "out").exists()


CAUSE = {"name": "current", "parameters": {
    "north": {"estimate": 0.04, "ci95": [0.03, 0.05], "unit": "m/s"}
}}  # fmt: skip


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_words(verdict):
    answer = {
        "verdict": verdict,
        "causes": [CAUSE],
        "alternatives": [[{**CAUSE, "name": "tether"}]],
        "gain": {
            "final_runs": ["a"], "share_of_reachable": {"estimate": 0.9, "ci95": [0.8, 1.0]}
        },
        "preconditions": [{"name": "wave", "excited": False}],
        "unexplained": [{"direction": "surge", "depends_on": "depth"}],
    }  # fmt: skip
    said = headline(answer)
    mentioned = {
        "no_misfit": "detectable", "not_excited": "could not", "parameters": "current",
        "cause": "lacks current (north 0.04 m/s)", "ambiguous": "or instead tether",
        "outside_library": "no known effect", "partial": "tether", "inputs": "Once corrected",
    }  # fmt: skip
    assert mentioned[verdict] in said.verdict
    assert "90 %" in said.closed
    assert "1 of 1 known effects" in said.caveats
    console = Console(file=io.StringIO(), width=400)
    print_headline(console, answer)
    assert all(line in console.file.getvalue() for line in said.lines)


def test_what_alternatives_share_is_told_once_and_many_causes_without_values():
    wave, drag, lag, delay = ({**CAUSE, "name": n} for n in ("wave", "drag", "lag", "delay"))
    two = headline(ambiguous([wave, lag], [wave, delay])).verdict
    assert two.startswith("The simulation lacks wave (north 0.04 m/s), and either lag (")
    assert " or delay (" in two
    many = headline(ambiguous([CAUSE, wave, drag, lag], [CAUSE, wave, drag, delay])).verdict
    assert "lacks current (north 0.04 m/s), wave (north 0.04 m/s) and drag (" in many
    every = [CAUSE, wave, drag, lag]
    told = headline({"verdict": "cause", "causes": every, "alternatives": []}).verdict
    assert told == "The simulation lacks current, wave, drag and lag."
    beside = {
        **ambiguous([wave]),
        "verdict": "partial",
        "alternatives": [[wave, lag], [wave, delay]],
    }
    told = headline(beside).verdict
    assert told.startswith("The simulation lacks wave (north 0.04 m/s), and either lag (")
    assert "(these data do not tell which), and something that no known effect explains" in told
    contained = headline(ambiguous([wave, lag], [wave])).verdict
    assert contained.endswith(", or instead wave (north 0.04 m/s).")


def ambiguous(causes, *alternatives):
    return {"verdict": "ambiguous", "causes": causes, "alternatives": list(alternatives)}


@pytest.mark.parametrize(
    ("runs", "ci95", "shown"),
    [(["a", "b", "c"], [0.8, 1.0], True), (["a", "b", "c"], None, False), (["a"], None, False)],
)
def test_the_interval_of_the_gain_is_shown_where_there_is_one(runs, ci95, shown):
    gain = {"final_runs": runs, "share_of_reachable": {"estimate": 0.9, "ci95": ci95}}
    answer = {"verdict": "cause", "causes": [CAUSE], "alternatives": [], "gain": gain}
    said = headline(answer)
    assert "closes 90 %" in said.closed
    assert ("(95 % interval: 80 to 100 %)" in said.closed) == shown
    assert ("no interval over runs" in said.caveats) == (len(runs) < 3)


def test_an_answer_that_closes_hardly_any_gap_says_so_first():
    answer = {"verdict": "cause", "causes": [CAUSE], "alternatives": []}
    for share, doubtful in ((0.05, True), (0.5, False)):
        gain = {
            "final_runs": ["a"], "share_of_reachable": {"estimate": share, "ci95": [0.0, 1.0]}
        }  # fmt: skip
        said = headline({**answer, "gain": gain})
        assert said.verdict.startswith("Doubtful: the simulation lacks") == doubtful
        assert said.next_step.startswith("do not use the extended model") == doubtful
