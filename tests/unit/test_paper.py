"""The paper's statements: what the model says, and that each criterion can fail."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fish_env.files import check_chosen
from fish_env.plotting import style
from fish_env.studies.paper import Study, all_statements, run_study, with_servo_lag
from fish_env.studies.paper.report import write_report
from fish_env.studies.paper.statements import NOT_HELD, trend

EXPECTED_NOT_HELD = {
    "pitch oscillates about zero",
    "the amplitude of the yaw rate grows with the offset",
    "the amplitude of the yaw rate falls with f1",
    "the amplitude of the roll rate falls with f1",
    "the amplitude of the pitch rate falls with f1",
    "at dd -1.7 to -2.0 cm the depth is used up before the motion is uniform",
}


@pytest.fixture(scope="module")
def study() -> Study:
    return run_study()


def verdicts(study: Study) -> dict[str, bool]:
    return {s.statement: s.held for s in all_statements(study)}


def test_the_model_holds_what_it_is_known_to_hold(study: Study) -> None:
    found = {statement for statement, held in verdicts(study).items() if not held}
    assert found == EXPECTED_NOT_HELD


def test_a_lagging_servo_explains_the_falling_amplitudes_but_not_all(study: Study) -> None:
    found = {s.statement: s.held for s in with_servo_lag(study)}
    for angle in ("yaw", "roll", "pitch"):
        assert found[f"the amplitude of the {angle} rate falls with f1"]
    assert found["R_t falls with the offset"]
    assert not found["w_t grows with f1"]


def changed(study: Study, part: str, **motion: Any) -> Study:
    old = getattr(study, part)
    new = {name: change(old.motion[name]) for name, change in motion.items()}
    return dataclasses.replace(
        study, **{part: dataclasses.replace(old, motion={**old.motion, **new})}
    )


@pytest.mark.parametrize(
    ("part", "name", "change", "statement"),
    [
        ("straight", "horizontal_speed", lambda v: v[:, ::-1], "U_r grows with f1"),
        ("straight", "horizontal_speed", lambda v: v[::-1], "U_r grows with A1"),
        ("straight", "roll_extreme", lambda v: v + 0.06, "roll stays within 3 deg"),
        ("straight", "pitch_extreme", lambda v: v + 0.06, "pitch stays within 3 deg"),
        ("straight", "roll", lambda v: v + 0.03, "roll oscillates about zero"),
        ("straight", "yaw_rate", lambda v: v + 0.01, "yaw oscillates about a constant"),
        ("straight", "yaw_amplitude", lambda v: v[::-1], "the yaw amplitude grows with A1"),
        ("straight", "yaw_rate_amplitude", lambda v: v[:, ::-1], "the yaw rate grows with f1"),
        ("turning", "yaw_rate", lambda v: v[::-1], "w_t grows with the offset"),
        ("turning", "yaw_rate", lambda v: v[:, ::-1], "w_t grows with f1"),
        ("turning", "turn_radius", lambda v: v[::-1], "R_t falls with the offset"),
        (
            "turning",
            "turn_radius",
            lambda v: v * np.linspace(0.8, 1.2, v.shape[1]),
            "R_t is nearly constant in f1",
        ),
        (
            "turning",
            "yaw_rate",
            lambda v: -v,
            "a negative offset gives a positive yaw rate, a positive one a negative",
        ),
        ("gliding", "speed", lambda v: v[::-1], "U_g falls as |dd| grows from 0 to 1.4 cm"),
        (
            "spiral",
            "yaw_rate",
            lambda v: v * np.linspace(1, 2, len(v)),
            "w_s barely changes with dd",
        ),
        ("spiral", "speed", lambda v: v * np.linspace(1, 2, len(v)), "U_s barely changes with dd"),
    ],
)
def test_a_broken_motion_fails_its_statement(
    study: Study, part: str, name: str, change: Any, statement: str
) -> None:
    assert verdicts(study)[statement]
    assert not verdicts(changed(study, part, **{name: change}))[statement]


def test_a_straight_swim_is_no_spiral(study: Study) -> None:
    straight = study.straight_series[(20.0, 3.0)]
    found = verdicts(dataclasses.replace(study, spiral_series=straight))
    for statement in ("V_Ix and V_Iy are sine-like", "yaw grows steadily"):
        assert not found[statement]


def test_a_sinking_spiral_does_not_spiral_up(study: Study) -> None:
    spiral = study.spiral_series
    states = spiral.states * np.where(np.array(spiral.state_names) == "z", -1.0, 1.0)
    sinking = dataclasses.replace(spiral, states=states)
    found = verdicts(dataclasses.replace(study, spiral_series=sinking))
    assert not found["V_Iz settles at a negative value: the fish spirals up"]


def test_a_trend_needs_every_series() -> None:
    rising = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 2.0]])
    assert not trend("m", "s", rising, 1, True, "m").held
    assert trend("m", "s", rising[:1], 1, True, "m").held
    assert trend("m", "s", rising[:1, ::-1], 1, False, "m").held
    assert trend("m", "s", rising[:1], 1, False, "m").verdict == NOT_HELD


def test_the_report_says_everything(study: Study, tmp_path: Path) -> None:
    words, numbers = write_report(study, tmp_path)
    text, data = words.read_text(), json.loads(numbers.read_text())
    for statement in all_statements(study):
        assert statement.criterion.replace("|", "\\|") in text
    assert len(data["statements"]) == len(all_statements(study))
    assert text.count(f"**{NOT_HELD}**") >= len(EXPECTED_NOT_HELD)
    assert np.shape(data["turning"]["motion"]["turn_radius"]) == (7, 5)


def test_every_figure_is_drawn(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fish_env.studies.paper.figures import draw_study, picture_files

    monkeypatch.setattr(style, "DOTS_PER_INCH", 40)
    monkeypatch.setattr(style, "FORMATS", ("png",))
    pictures = draw_study(study, tmp_path)
    assert len(pictures) == len({path.name for path in pictures}) == 12
    assert sorted(picture_files(tmp_path)) == sorted(tmp_path.iterdir())
    check_chosen(picture_files(tmp_path))  # which lets a second study replace them
