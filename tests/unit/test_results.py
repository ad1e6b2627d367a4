"""Long results: made once, put in place whole, and written under their day."""

import datetime
import json

import pytest

from scripts.results import kept, write_dated


def test_a_result_is_made_once(tmp_path):
    made = []

    def make():
        made.append(1)
        return {"value": 3}

    file = tmp_path / "work" / "one.json"
    assert kept(file, make) == kept(file, make) == {"value": 3}
    assert made == [1]


def test_a_result_that_fails_leaves_nothing_to_read_back(tmp_path):
    def fail():
        raise RuntimeError

    with pytest.raises(RuntimeError):
        kept(tmp_path / "one.json", fail)
    assert kept(tmp_path / "one.json", lambda: {"value": 1}) == {"value": 1}


def test_a_dated_result_says_when_and_of_which_sources(tmp_path):
    file = write_dated(tmp_path / "results", "kind", {"value": 2}, "# Kind\n")
    day = datetime.date.today().isoformat()
    assert file.name == f"kind-{day}.json"
    content = json.loads(file.read_text())
    assert (content["date"], content["value"]) == (day, 2)
    assert content["commit"]
    assert file.with_suffix(".md").read_text() == "# Kind\n"
