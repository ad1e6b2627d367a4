"""The page of the decision policy holds what the policy is."""

from dataclasses import replace

import pytest

from fish_env.inference.policy import POLICY
from scripts.make_policy_page import PAGE, with_table


def test_the_page_is_made_from_the_policy():
    page = PAGE.read_text(encoding="utf-8")
    assert with_table(page) == page


def test_a_page_of_other_numbers_is_noticed():
    page = PAGE.read_text(encoding="utf-8")
    assert with_table(page.replace("| 4000 |", "| 4001 |")) == page


def test_every_number_names_its_source():
    assert all(source for _, _, source in POLICY.table())


@pytest.mark.parametrize(("name", "value"), [("screen_level", 0.9), ("most_causes", 0)])
def test_a_number_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"policy {name}: choose a value"):
        replace(POLICY, **{name: value})
