"""The errors a user meets."""

import pickle
import re
import shlex
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from fish_env import errors

ROOT = Path(__file__).resolve().parents[2]
INDEXED = re.compile(r"pip install [^\n]*(?<![\w/])robotic-fish")


def test_every_error_is_a_robotic_fish_error_and_says_when_it_is_raised():
    classes = [item for item in vars(errors).values() if isinstance(item, type)]
    raised = [item for item in classes if issubclass(item, Exception)]
    assert len(raised) == 10
    for item in raised:
        assert issubclass(item, errors.RoboticFishError)
        assert item.__doc__


def test_a_missing_extra_says_what_to_install():
    error = errors.missing_extra("Training a policy", "torch", "train")
    line = str(error).partition("Install it with: pip install ")[2]
    named = {Requirement(text).name for text in shlex.split(line)}
    assert named == {"stable-baselines3", "tensorboard", "torch", "tqdm"}
    assert "Training a policy needs the package 'torch'" in str(error)
    with pytest.raises(ImportError):
        raise error


def test_a_divergence_carries_time_and_state_across_processes():
    error = pickle.loads(pickle.dumps(errors.SimulationDiverged(1.5, [1.0, 2.0])))
    assert (error.time_s, error.state) == (1.5, [1.0, 2.0])
    assert "t = 1.5000 s" in str(error)
    assert "smaller time step" in str(error)


def test_no_message_and_no_page_names_the_package_on_an_index():
    """The package is on no index: pip would find nothing, or what somebody else puts there."""
    files = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("fish_env/**/*.py")]
    files += [*ROOT.glob("agents/**/*.py"), *ROOT.glob("scripts/**/*.py")]
    wrong = [file for file in files if INDEXED.search(file.read_text(encoding="utf-8"))]
    assert wrong == []


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ('pip install "robotic-fish[render]"', True),
        ("pip install robotic-fish", True),
        ('pip install ".[render]"', False),
        ('pip install "dist/robotic_fish-0.2.0-py3-none-any.whl[render]"', False),
    ],
)
def test_the_check_of_pip_lines_knows_an_index_from_a_file(line, wrong):
    assert bool(INDEXED.search(line)) == wrong
