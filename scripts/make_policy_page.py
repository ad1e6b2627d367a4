"""Writes the tables of docs/policy.md from the policies themselves."""

from __future__ import annotations

from pathlib import Path

from fish_env.diagnosis.policy import POLICIES
from fish_env.inference.policy_numbers import Numbers

PAGE = Path(__file__).resolve().parents[1] / "docs" / "policy.md"


def main() -> None:
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def with_tables(page: str) -> str:
    """The page with its tables made anew."""
    for name, policy in POLICIES.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->\n"
        before, rest = page.split(begin)
        page = f"{before}{begin}\n{table_of(policy)}\n{end}{rest.split(end)[1]}"
    return page


def table_of(policy: Numbers) -> str:
    """Name, value, meaning and source of every number of a policy."""
    meanings = policy.meanings()
    rows = ["| number | value | what it decides | source |", "| --- | ---: | --- | --- |"]
    for name, value, source in policy.table():
        rows.append(f"| `{name}` | {value:.4g} | {meanings[name]} | {source} |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    main()
