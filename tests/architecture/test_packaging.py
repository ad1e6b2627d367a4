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


def pinned(name: str) -> dict[str, str]:
    """Package -> version that a constraints file pins."""
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    pins = (line.rstrip(" \\").split("==") for line in lines if "==" in line)
    return {canonicalize_name(package): version for package, version in pins}


TESTED, TESTED_CLIENTS = pinned("constraints.txt"), pinned("constraints-clients.txt")
REQUIREMENTS = [
    *((item, TESTED) for item in PROJECT["dependencies"]),
    *((item, TESTED_CLIENTS) for item in (*PROJECT["dependencies"], *EXTRAS["clients"])),
    *((i, TESTED) for extra, items in EXTRAS.items() if extra != "clients" for i in items),
]


@pytest.mark.parametrize(("text", "versions"), REQUIREMENTS)
def test_every_requirement_admits_the_version_it_was_tested_with(text, versions):
    requirement = Requirement(text)
    assert requirement.specifier.contains(versions[canonicalize_name(requirement.name)])


@pytest.mark.parametrize("name", ["constraints.txt", "constraints-clients.txt"])
def test_constraints_name_versions_only(name):
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"#.*|[\w.-]+==[\w.]+", line)] == []


def test_the_lock_holds_what_is_asked_for_in_the_tested_versions():
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8")
    asked = [*PROJECT["dependencies"]]
    for extra in re.findall(r"--extra (\w+)", recipe):
        asked += EXTRAS[extra]
    locked = pinned("requirements.lock")
    missing = {canonicalize_name(Requirement(item).name) for item in asked} - set(locked)
    assert missing == set(), "run `make lock`"
    assert {name: TESTED.get(name, version) for name, version in locked.items()} == locked


def test_the_base_install_needs_no_torch():
    assert not [item for item in PROJECT["dependencies"] if "torch" in item or "baselines" in item]


def test_torch_is_a_range_that_the_constraints_pin():
    torch = {item for items in EXTRAS.values() for item in items if item.startswith("torch>")}
    assert torch == {"torch>=2.5,<3"}
    assert TESTED["torch"] == "2.13.0"
    assert not [item for items in EXTRAS.values() for item in items if "torch==" in item]
