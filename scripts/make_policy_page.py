"""Writes the tables of docs/policy.md from the policy itself."""

from __future__ import annotations

from pathlib import Path

from fish_env.inference.policy import POLICY, DecisionPolicy

PAGE = Path(__file__).resolve().parents[1] / "docs" / "policy.md"
BEGIN, END = "<!-- policy -->\n", "<!-- end of policy -->\n"


def main() -> None:
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def with_table(page: str) -> str:
    """The page with its table made anew."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{table()}\n{END}{rest.split(END)[1]}"


def table() -> str:
    """Name, value, meaning and source of every number."""
    meanings = _meanings()
    rows = ["| number | value | what it decides | source |", "| --- | ---: | --- | --- |"]
    for name, value, source in POLICY.table():
        rows.append(f"| `{name}` | {value:.4g} | {meanings[name]} | {source} |")
    return "\n".join(rows) + "\n"


def _meanings() -> dict[str, str]:
    """What the class says of each number."""
    text = (DecisionPolicy.__doc__ or "").split("Attributes:")[1]
    found: dict[str, str] = {}
    for line in text.strip().splitlines():
        name, _, meaning = line.strip().partition(": ")
        found[name] = meaning.rstrip(".")
    return found


if __name__ == "__main__":
    main()
