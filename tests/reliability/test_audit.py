"""The audit says when it looked at nothing; the lock file has a hash for each package."""

import re

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from scripts.reliability.audit import LOCK, verdict
from tests.architecture.test_packaging import PROJECT, TESTED

CLEAN = {"name": "a", "version": "1", "vulns": []}
KNOWN = {"name": "b", "version": "2", "vulns": [{"id": "PYSEC-1"}]}
SKIPPED = {"name": "c", "skip_reason": "not found"}


@pytest.mark.parametrize(
    ("packages", "status", "words"),
    [
        ([CLEAN], 0, "no known vulnerability in 1"),
        ([CLEAN, KNOWN, SKIPPED], 1, "b 2: PYSEC-1"),
        ([CLEAN, SKIPPED], 2, "not audited: 1 of 2"),
        ([], 2, "not audited"),
    ],
)
def test_nothing_looked_up_is_no_clean_bill(packages, status, words):
    found, said = verdict({"dependencies": packages})
    assert found == status
    assert words in said


def locked():
    text = LOCK.read_text(encoding="utf-8").replace("\\\n", " ")
    return [line for line in text.splitlines() if line.strip()]


def test_every_locked_package_has_the_tested_version_and_a_hash():
    for line in locked():
        name, version = re.match(r"([\w.-]+)==([\w.]+)", line).groups()
        assert TESTED.get(canonicalize_name(name), version) == version
        assert "--hash=sha256:" in line


def test_the_lock_holds_what_the_base_install_needs():
    names = {canonicalize_name(line.split("==")[0]) for line in locked()}
    assert {canonicalize_name(Requirement(item).name) for item in PROJECT["dependencies"]} <= names
