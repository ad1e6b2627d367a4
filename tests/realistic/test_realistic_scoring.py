"""Made-up answers: each criterion is met by the right ones and missed by broken ones."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import asdict
from pathlib import Path

import pytest

from fish_env.errors import DatasetError
from tests.hidden import suite
from tests.hidden.realistic.faults import FAULTS
from tests.hidden.realistic.plans import TIERS
from tests.hidden.realistic.scoring import failed, score
from tests.hidden.realistic.summary import CRITERIA, markdown, summarise
from tests.hidden.realistic.truth import RealTruth

ROOT = Path(__file__).resolve().parents[2]
LAG = {"time_constant": 0.05}
SMALL = {"tail_gain": {"gain": 0.98}, "buoyancy_offset": {"mass": 0.0005}}
DIRT = {"outliers": {"share": 0.005, "size": 20.0}, "gyro_scale": {"p": 1.01}}
VARIED = [{"com_offset": {"x": 1e-4}}, {"com_offset": {"x": -1e-4}}]


def truth_of(tier, **about):
    if TIERS[tier].budget:
        about = {"main": {"servo_lag": LAG}, "budget": {"servo_lag": {"all": 0.6}}} | about
    if TIERS[tier].real:
        about = {"small": SMALL, "dirt": DIRT, "variation": VARIED} | about
    if tier == "suspects":
        about = {"suspect": {"offset_gain": {"gain": 0.7}}} | about
    if tier == "foreign_plant":
        about = {"foreign": {"linked_tail": {"share": 1.0}}} | about
    return RealTruth(tier, 0, "zheng-2021-a", **about)


def named(*names, verdict="cause", **more):
    return {"verdict": verdict, "causes": [{"name": name} for name in names], **more}


def quiet(verdict="no_misfit"):
    return {"verdict": verdict, "causes": []}


def lag(estimate=0.05, low=0.045, high=0.055):
    return {
        "verdict": "partial",
        "causes": [
            {
                "name": "servo_lag",
                "parameters": {"time_constant": {"estimate": estimate, "ci95": [low, high]}},
            }
        ],
        "budget": [{"name": "servo_lag", "share": 0.62, "ci95": [0.55, 0.7]}],
    }


def fault(name):
    return truth_of("suspects", suspect={name: {}}, tells=FAULTS[name].tells)


# What is true


@pytest.mark.parametrize(
    "name",
    ["servo_lag", "tail_gain", "buoyancy_offset", "parameter:mass.buoyancy", "com_offset",
     "gyro_scale", "parameter:mass.static_moment_rest[0]"],
)  # fmt: skip
def test_what_acts_is_true_however_small_and_by_any_equal_name(name):
    row = score(truth_of("realistic"), named(name))
    assert row.claimed == (name,)
    assert row.false_names == ()


@pytest.mark.parametrize("name", ["tether", "parameter:tail.drag.c2", "servo_delay"])
def test_what_does_not_act_is_false(name):
    row = score(truth_of("realistic"), named("servo_lag", name, verdict="partial"))
    assert row.false_names == (name,)
    assert row.main_named


def test_verdicts_that_name_nothing_claim_nothing():
    for verdict in ("outside_library", "no_misfit", "not_excited"):
        row = score(truth_of("realistic"), named("tether", verdict=verdict))
        assert (row.claimed, row.false_names, row.main_named) == ((), (), False)


def test_an_ambiguous_answer_stands_for_its_best_set():
    sets = [[{"name": "servo_lag"}], [{"name": "tether"}, {"name": "current"}]]
    answer = named("servo_delay", verdict="ambiguous", alternatives=sets)
    row = score(truth_of("realistic"), answer)
    assert row.main_named
    assert row.claimed == ("servo_lag",)
    assert row.false_names == ()
    wrong = score(truth_of("realistic"), answer | {"alternatives": sets[1:]})
    assert not wrong.main_named
    assert wrong.false_names == ("servo_delay",)


def test_blaming_right_inputs_is_false_and_noise_may_be_blamed():
    blame = quiet("inputs") | {"inputs": [{"column": "yaw", "message": "yaw has the wrong sign"}]}
    assert score(truth_of("realistic"), blame).false_names == ("inputs",)
    assert score(truth_of("noise_only"), blame).false_names == ()
    refusal = failed(truth_of("realistic"), DatasetError("r is stuck"), "")
    assert refusal.false_names == ("refused",)


# The main effect


def test_parameters_of_the_main_effect_are_compared():
    right = score(truth_of("realistic"), lag())
    assert right.errors == {"servo_lag.time_constant": 0.0}
    assert right.covered == {"servo_lag.time_constant": True}
    off = score(truth_of("realistic"), lag(0.06, 0.058, 0.062))
    assert off.errors["servo_lag.time_constant"] == pytest.approx(0.2)
    assert off.covered == {"servo_lag.time_constant": False}


def test_the_share_of_the_main_effect_is_compared_where_a_budget_is_published():
    truth = truth_of("realistic")
    assert score(truth, lag()).budget_error == pytest.approx(0.02)
    assert score(truth, named("servo_lag")).budget_error is None
    nested = lag() | {"budget": {"left": 0.1, "shares": lag()["budget"]}}
    assert score(truth, nested).budget_error == pytest.approx(0.02)
    without = named("servo_lag", budget=[{"name": "tether", "share": 0.9}])
    assert score(truth, without).budget_error == pytest.approx(-0.6)


# Suspects


def test_a_suspect_is_named_by_its_name_or_told_by_the_inputs():
    truth = truth_of("suspects")
    assert score(truth, named("offset_gain")).told
    assert not score(truth, named("tail_gain")).told
    assert score(truth, named("tail_gain")).false_names == ("tail_gain",)
    assert not score(truth, quiet()).told
    wrong = fault("sign:tail_offset")
    right = quiet("inputs") | {"inputs": [{"message": "tail_offset has the wrong sign"}]}
    assert score(wrong, right).told
    assert score(wrong, right).false_names == ()
    other = quiet("inputs") | {"inputs": [{"message": "block_angle has the wrong sign"}]}
    assert not score(wrong, other).told
    assert score(wrong, other).false_names == ("inputs",)


def test_a_message_under_another_verdict_tells_too_and_a_refusal_that_has_the_column():
    wrong = fault("sign:yaw")
    beside = quiet("outside_library") | {"inputs": ["yaw changes against what r says"]}
    assert score(wrong, beside).told
    assert failed(wrong, DatasetError("yaw changes against what r says"), "").told
    assert not failed(wrong, DatasetError("the clock jumps"), "").told
    assert not failed(wrong, ValueError("yaw"), "trace").told
    assert failed(wrong, ValueError("yaw"), "trace").verdict == "error"


def test_a_message_blames_its_target_not_what_it_is_compared_with():
    entry = {"kind": "sign", "target": "yaw", "fix": "channels: {yaw: {sign: -1}}",
             "words": "yaw has the wrong sign; the disagreement of yaw and r falls"}  # fmt: skip
    answer = quiet("inputs") | {"inputs": [entry]}
    assert score(fault("sign:yaw"), answer).told
    assert not score(fault("sign:r"), answer).told
    other = answer | {"inputs": [entry | {"alternatives": ["channels: {r: {sign: -1}}"]}]}
    assert score(fault("sign:r"), other).told


def test_an_answer_goes_on_once_inputs_are_put_right():
    entry = {"kind": "beat", "target": "tail_frequency", "fix": "..."}
    answer = named("tether", verdict="inputs", inputs=[entry])
    truth = truth_of("suspects", suspect={"frequency_scale": {"scale": 0.6}}, tells=("beat",))
    for rest, false in (("cause", ("tether",)), ("outside_library", ())):
        row = score(truth, answer | {"verdict_once_corrected": rest})
        assert row.told
        assert row.false_names == false


def test_a_word_within_a_word_tells_nothing():
    assert not score(fault("sign:r"), quiet() | {"inputs": ["your runs differ"]}).told
    assert score(fault("sign:r"), quiet() | {"inputs": ["the sign of r"]}).told


def test_a_beat_in_some_runs_may_be_told_of_beats_or_named():
    truth = truth_of(
        "suspects", suspect={"frequency_scale:some runs": {"scale": 0.6}}, tells=("beat",)
    )
    assert score(truth, quiet() | {"inputs": ["the beats of r03 are 0.6 of the command"]}).told
    assert score(truth, named("frequency_scale")).told


def test_noise_of_another_kind_may_be_lived_with_but_not_be_called_an_effect():
    truth = truth_of("suspects", suspect={"outliers": {"share": 0.01, "size": 20.0}})
    assert score(truth, quiet()).told
    assert not score(truth, quiet("outside_library")).told
    assert not score(truth, named("tether")).told


def test_beside_the_unknown_too_alternatives_stand_for_their_best():
    sets = [[{"name": "tail_gain"}, {"name": other}] for other in ("tether", "servo_lag")]
    answer = named("tail_gain", verdict="partial", alternatives=sets)
    row = score(truth_of("realistic", small=SMALL), answer)
    assert row.main_named
    assert set(row.claimed) == {"tail_gain", "servo_lag"}
    assert row.false_names == ()
    wrong = score(truth_of("realistic", small=SMALL), answer | {"alternatives": sets[:1]})
    assert wrong.false_names == ("tether",)
    assert not wrong.main_named


def test_a_name_that_no_answer_can_give_is_outside():
    truth = truth_of("suspects")
    assert score(truth, quiet("outside_library"), {"servo_lag", "offset_gain"}).nameable
    row = score(truth, quiet("outside_library"), {"servo_lag"})
    assert not row.nameable
    assert not row.told
    assert score(truth_of("realistic"), quiet(), {"servo_lag"}).nameable


# Foreign plants


def test_a_foreign_plant_is_outside_or_in_part_with_true_names():
    truth = truth_of("foreign_plant")
    assert score(truth, quiet("outside_library")).outside_right
    assert not score(truth, named("servo_lag", verdict="partial")).outside_right
    assert not score(truth, named("servo_lag")).outside_right
    assert not score(truth, quiet("partial")).outside_right
    assert not score(truth, quiet()).outside_right
    both = truth_of("foreign_plant", small=SMALL)
    assert score(both, named("tail_gain", verdict="partial")).outside_right


# The whole suite

RIGHT = {
    "realistic": lag(),
    "realistic_60": lag(),
    "realistic_30": lag(),
    "small_only": quiet("no_misfit"),
    "suspects": named("offset_gain"),
    "foreign_plant": quiet("outside_library"),
    "noise_only": quiet("outside_library"),
}
BROKEN = {
    0: {"realistic": quiet()},
    1: {"realistic_60": quiet("outside_library")},
    2: {"realistic_30": named("servo_lag", "tether", verdict="partial")},
    3: {tier: lag(0.06) for tier in ("realistic", "realistic_60", "realistic_30")},
    4: {
        tier: lag() | {"budget": [{"name": "servo_lag", "share": 0.4}]}
        for tier in ("realistic", "realistic_60", "realistic_30")
    },
    5: {"small_only": named("tether")},
    6: {"suspects": quiet("outside_library")},
    7: {"suspects": named("offset_gain", "tether", verdict="partial")},
    8: {"foreign_plant": named("tail_flexibility")},
    9: {"noise_only": named("tether")},
}
"""Answers that break one criterion, by its number."""


def verdicts(answers):
    rows = [score(truth_of(tier), answers[tier]) for tier in TIERS]
    return [one["met"] for one in summarise(rows)["criteria"]], rows


def test_right_answers_meet_every_criterion():
    met, rows = verdicts(RIGHT)
    assert met == [True] * len(CRITERIA)
    page = markdown(summarise(rows))
    assert page.count("| met |") == len(CRITERIA)
    assert "not met" not in page


@pytest.mark.parametrize("number", BROKEN)
def test_each_criterion_is_missed_by_a_broken_answer(number):
    met, rows = verdicts(RIGHT | BROKEN[number])
    assert met[number] is False
    allowed = {number, 2} | ({7} if number == 6 else set())
    assert all(value for i, value in enumerate(met) if i not in allowed)
    assert CRITERIA[number].about in markdown(summarise(rows))
    assert len(BROKEN) == len(CRITERIA)


def test_no_answer_is_no_success():
    broken = [failed(truth_of(tier), ValueError("no"), "trace") for tier in TIERS]
    met = [one["met"] for one in summarise(broken)["criteria"]]
    # Names, parameters and budgets there are none of; nothing false is said beside a suspect.
    assert met == [False, False, None, None, None, False, False, True, False, False]


def test_a_row_is_read_back_as_it_was():
    row = score(truth_of("realistic"), lag())
    again = suite.row_of(json.loads(json.dumps({"row": asdict(row)})), type(row))
    assert again == row


def test_the_benchmark_goes_on_where_it_stopped(tmp_path, capsys):
    spec = importlib.util.spec_from_file_location(
        "benchmark_diagnosis", ROOT / "scripts" / "benchmark_diagnosis.py"
    )
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    options = ["--suite", "realistic", "--tiers", "noise_only,foreign_plant", "--limit", "2"]
    options += ["--processes", "1", "--work", str(tmp_path / "work"), "--out", str(tmp_path)]
    script.main([*options, "--diagnose", "tests.hidden.stubs:silent"])
    finished = {file: file.stat().st_mtime_ns for file in (tmp_path / "work/full").iterdir()}
    assert len(finished) == 2
    script.main([*options, "--diagnose", "tests.hidden.stubs:not_there"])
    assert {file: file.stat().st_mtime_ns for file in finished} == finished
    (result,) = tmp_path.glob("realistic-*.json")
    met = {one["about"]: one["met"] for one in json.loads(result.read_text())["criteria"]}
    assert met["nothing named in pure noise"] is True
    assert met["foreign plant told as such"] is False
    assert "Realistic suite" in capsys.readouterr().out
    script.main([*options, "--finished"])
    assert len([*tmp_path.glob("realistic-*.json")]) == 2
    with pytest.raises(SystemExit):
        script.main(["--suite", "realistic", "--tiers", "rich"])
    assert "no tier rich" in capsys.readouterr().err
