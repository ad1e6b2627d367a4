"""From measurement to policy: the loop at a tiny size, what is declared, and the page."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from fish_env.envs.vector import RoboticFish3DVectorEnv
from fish_env.errors import ConfigError
from fish_env.params import load_fish
from robofish_agents.evaluation.suites import RESERVED_SEEDS, load_suite
from scripts import measure_to_policy
from scripts.loop import training
from scripts.loop.declaration import DECLARED, load_declaration
from scripts.loop.measuring import measure_and_diagnose
from scripts.loop.training import ARMS, POSTERIOR, fish_options, scored
from scripts.update_readme import updated

KNOWING = "tests.agents.loop_stubs:knowing"
BLIND = "tests.agents.loop_stubs:blind"


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    """The declaration with two fish, two seeds, a moment of training and two short episodes."""
    folder = tmp_path_factory.mktemp("tiny")
    suite = {
        "name": "tiny", "version": 1, "summary": "two short episodes", "seed": 1000,
        "episodes": 2, "episode_steps": 20, "environment": {},
        "fingerprint": {"hold": 0.0, "track": 0.0},
    }  # fmt: skip
    (folder / "suite.yaml").write_text(yaml.safe_dump(suite))
    tree = yaml.safe_load(DECLARED.read_text())
    tree["fish"] = dict(list(tree["fish"].items())[:2])
    tree |= {"seeds": [0, 1], "suite": str(folder / "suite.yaml")}
    tree["training"]["changes"] |= {
        "total_steps": 512, "num_envs": 4, "checkpoint_every": 128,
        "ppo": {"n_steps": 32, "batch_size": 64, "n_epochs": 1},
        "imitate": {"rounds": 2, "epochs": 1},
        "evaluation": {"every": 512, "episodes": 1},
    }  # fmt: skip
    file = folder / "tiny.yaml"
    file.write_text(yaml.safe_dump(tree))
    return file


def run(tiny: Path, folder: Path, diagnose: str = KNOWING) -> dict:
    """Runs the script and reads its result."""
    places = ["--work", str(folder / "work"), "--out", str(folder / "results")]
    measure_to_policy.main(["--declared", str(tiny), "--diagnose", diagnose, *places])
    (file,) = (folder / "results").glob("*.json")
    return json.loads(file.read_text())


@pytest.fixture(scope="module")
def finished(tiny, tmp_path_factory) -> tuple[Path, dict]:
    folder = tmp_path_factory.mktemp("finished")
    return folder, run(tiny, folder)


@pytest.mark.slow
@pytest.mark.long
def test_the_loop_ends_with_scores_of_all_and_tables(finished):
    folder, record = finished
    assert len(record["scores"]) == 2 * 2 * len(ARMS)
    assert {row["trained_on"] for row in record["scores"]} == set(ARMS)
    assert [entry["verdict"] for entry in record["fish"]] == ["cause", "cause"]
    (page,) = (folder / "results").glob("*.md")
    assert "drifting" in page.read_text()


@pytest.mark.slow
@pytest.mark.long
def test_every_model_teaches_something_else(finished):
    """Scores of one fish and seed differ from model to model, or the loop compares nothing."""
    _, record = finished
    chosen = [s for s in record["scores"] if (s["fish"], s["seed"]) == ("light", 0)]
    assert len({json.dumps(score["means"]) for score in chosen}) >= len(ARMS) - 1


@pytest.mark.slow
@pytest.mark.long
def test_a_second_run_trains_nothing(finished, tiny, monkeypatch):
    folder, record = finished
    monkeypatch.setattr(training, "train", None)
    again = run(tiny, folder)
    assert again["scores"] == record["scores"]


@pytest.mark.slow
@pytest.mark.long
def test_a_stopped_run_goes_on_to_the_same_scores(finished, tiny, tmp_path, monkeypatch):
    class Killed(training.Quiet):
        def stepped(self, steps: int) -> None:
            if steps > 300:
                raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(training, "Quiet", Killed)
        with pytest.raises(KeyboardInterrupt):
            run(tiny, tmp_path)
    scores = [[s["means"] for s in r["scores"]] for r in (run(tiny, tmp_path), finished[1])]
    assert scores[0] == scores[1]


@pytest.mark.slow
@pytest.mark.long
def test_another_extended_model_is_trained_anew(finished, tiny, tmp_path):
    """Nothing stale is read: a score is kept under what it depends on."""
    declared = load_declaration(tiny)
    folder, _ = finished
    hidden = declared.fish[0]
    known = measure_and_diagnose(declared, hidden, folder / "work" / "fish" / hidden.name)
    assert known.extended is not None
    first = scored(declared, known, "extended", 0, folder / "work")
    other = tmp_path / "extended.yaml"
    other.write_text(known.extended.read_text() + "\n# found again\n")
    again = scored(declared, replace(known, extended=other), "extended", 0, folder / "work")
    policies = folder / "work" / "policies"
    assert len(list(policies.glob("0-*"))) == 2 + 3 * len(declared.fish) + 1
    assert again.means == first.means


@pytest.mark.slow
@pytest.mark.long
def test_without_an_extended_model_the_printed_fish_is_all_there_is(tiny, tmp_path):
    record = run(tiny, tmp_path, BLIND)
    assert not any(entry["extended"] for entry in record["fish"])
    means = {(s["fish"], s["seed"], s["arm"]): s["means"] for s in record["scores"]}
    for (fish, seed, arm), score in means.items():
        if arm in ("extended", POSTERIOR):
            assert score == means[fish, seed, "baseline"]
    assert record["summary"][0]["closed"]["extended"]["mean"] == 0.0


@pytest.mark.slow
@pytest.mark.long
def test_draws_from_the_posterior_are_other_fish_each_time(finished, tiny):
    declared = load_declaration(tiny)
    folder, _ = finished
    known = measure_and_diagnose(
        declared, declared.fish[0], folder / "work" / "fish" / declared.fish[0].name
    )
    env = RoboticFish3DVectorEnv(8, **fish_options(declared, known, POSTERIOR))
    _, info = env.reset(seed=0)
    drawn = info["parameter/effects.current.north"]
    true = known.truth.effects["current"]["north"]
    assert len(set(drawn)) == 8
    assert np.all(abs(drawn / true - 1.0) < 0.03)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """The declared fish, each with what was measured of it, diagnosed by nobody; and the folder."""
    folder, declared = tmp_path_factory.mktemp("measured"), load_declaration()
    return [
        (hidden, measure_and_diagnose(declared, hidden, folder / hidden.name, BLIND), folder)
        for hidden in declared.fish
    ]


def test_what_is_measured_does_not_give_the_answer_away(measured):
    """Folder and names are all that a diagnosis sees."""
    for hidden, _, folder in measured:
        text = (folder / hidden.name / "runs" / "dataset.yaml").read_text()
        assert "zheng-2021-a" in text
        assert hidden.effects
        assert not any(name in text for name in hidden.effects)


def drift(fish) -> np.ndarray:
    """Where a fish is after twelve seconds of a steady beat from the same start."""
    env = RoboticFish3DVectorEnv(1, fish=fish)
    env.reset(seed=3)
    for _ in range(120):
        *_, info = env.step(np.zeros((1, 5), np.float32))
    return np.array([info[key][0] for key in ("north", "east", "depth", "heading")])


def test_the_declared_fish_load_and_swim_otherwise_than_the_printed_one(measured):
    declared = load_declaration()
    assert len(declared.fish) == len(declared.seeds) == 5
    printed = drift(declared.printed)
    assert np.array_equal(drift(load_fish(declared.printed)), printed)
    for hidden, known, _ in measured:
        assert set(known.truth.effects) == set(hidden.effects)
        moved = np.abs(drift(known.true) - printed)
        assert moved[:3].max() > 0.05, hidden.name


def test_no_training_swims_the_episodes_that_judge():
    declared = load_declaration()
    suite = load_suite("calm")
    assert declared.suite == suite
    assert set(range(suite.seed, suite.seed + suite.episodes)) <= set(RESERVED_SEEDS)


def test_the_page_shows_the_latest_result():
    text = measure_to_policy.PAGE.read_text(encoding="utf-8")
    shown = updated(text, {"results": measure_to_policy.latest})
    assert text == shown, "run `make benchmark-loop`, or copy the tables of the latest result"


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("tier", "imaginary", "imaginary"),
        ("metrics", ["beauty"], "beauty"),
        ("fish", {"x": {"seed": 2, "effects": {"magic": 1.0}}}, "magic"),
        ("fish", {"x": {"seed": 3, "effects": {"current": 1.0}}}, "zheng-2021-b"),
        ("colour", "red", "colour"),
    ],
)
def test_a_wrong_declaration_says_what_is_wrong(key, value, what, tmp_path):
    file = tmp_path / "declared.yaml"
    file.write_text(yaml.safe_dump({**yaml.safe_load(DECLARED.read_text()), key: value}))
    with pytest.raises(ConfigError, match=what):
        load_declaration(file)
