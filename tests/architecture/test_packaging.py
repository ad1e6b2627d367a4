"""The project file, the tested versions and the set-up agree."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
TESTED = {
    canonicalize_name(line.split("==")[0]): line.split("==")[1]
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    if "==" in line
}
REQUIREMENTS = [
    *PROJECT["dependencies"],
    *(item for items in EXTRAS.values() for item in items),
]


@pytest.mark.parametrize("text", sorted(set(REQUIREMENTS)))
def test_every_requirement_admits_the_version_it_was_tested_with(text):
    requirement = Requirement(text)
    assert requirement.specifier.contains(TESTED[canonicalize_name(requirement.name)])


def test_constraints_name_versions_only():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"#.*|[\w.-]+==[\w.]+", line)] == []


def test_the_base_install_needs_no_torch():
    assert not [item for item in PROJECT["dependencies"] if "torch" in item or "baselines" in item]


def test_torch_is_pinned_wherever_it_is_asked_for():
    torch = {item for items in EXTRAS.values() for item in items if item.startswith("torch")}
    assert torch == {"torch==2.13.0"}
