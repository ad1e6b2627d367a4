"""The page of the decision policies holds what the policies are."""

from dataclasses import replace

import pytest

from fish_env.diagnosis.policy import POLICIES, policies_as_dict
from fish_env.inference.policy import POLICY
from scripts.make_policy_page import PAGE, with_tables

every_policy = pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES.keys())


def test_the_page_is_made_from_the_policies():
    page = PAGE.read_text(encoding="utf-8")
    assert with_tables(page) == page


def test_a_page_of_other_numbers_is_noticed():
    page = PAGE.read_text(encoding="utf-8")
    assert with_tables(page.replace("| 4000 |", "| 4001 |")) == page


@every_policy
def test_every_number_names_its_source(policy):
    assert all(source for _, _, source in policy.table())


@every_policy
def test_every_number_says_what_it_decides(policy):
    assert policy.meanings().keys() == policy.as_dict().keys()
    assert all(policy.meanings().values())


def test_no_two_numbers_have_one_name():
    """In ``diagnosis.json`` the numbers of all policies stand beside each other."""
    assert len(policies_as_dict()) == sum(len(policy.as_dict()) for policy in POLICIES.values())


def test_meanings_of_several_lines_are_whole():
    assert POLICY.meanings()["linear_doubt"].endswith("where a fit has yet to tell")


@pytest.mark.parametrize(("name", "value"), [("screen_level", 0.9), ("most_causes", 0)])
def test_a_number_out_of_range_is_refused(name, value):
    with pytest.raises(ValueError, match=f"policy {name}: choose a value"):
        replace(POLICY, **{name: value})
