"""`robofish effects`: the catalogue, for reading."""

from __future__ import annotations

import dataclasses
from math import isinf
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from fish_env.commands.numbers import write_json
from fish_env.effects import catalogue
from fish_env.model.effect import SECTIONS, Effect


def print_effects(console: Console, json_file: Path | None = None) -> None:
    """Prints every effect with its parameters, section by section.

    Args:
        console: Where they go.
        json_file: File for the same as JSON.
    """
    effects = catalogue().values()
    if json_file is not None:
        write_json(console, json_file, {effect.name: _numbers(effect) for effect in effects})
    for section in SECTIONS:
        members = [effect for effect in effects if effect.section == section]
        if members:
            console.print(Rule(section.capitalize(), align="left"))
        for effect in members:
            _print_effect(console, effect)
    console.print(
        "Switch one on in a fish file (effects: {servo_lag: {time_constant: 0.05}}), in a case, or "
        "with Simulator(fish, effects=...). At its neutral values an effect changes nothing.",
        highlight=False,
    )


def _numbers(effect: Effect) -> dict[str, Any]:
    words = {name: getattr(effect, name) for name in ("section", "summary", "equation", "source")}
    parameters = {p.name: dataclasses.asdict(p) for p in effect.parameters}
    return {**words, "parameters": parameters, "confusable_with": effect.confusable_with}


def _print_effect(console: Console, effect: Effect) -> None:
    console.print(f"[bold cyan]{effect.name}[/bold cyan]  {effect.summary}", highlight=False)
    console.print(Padding(Text(effect.equation, style="dim"), (0, 0, 0, 2)))
    console.print(Padding(_parameters(effect), (0, 0, 0, 2)))
    if effect.confusable_with:
        others = ", ".join(effect.confusable_with)
        console.print(Padding(f"easily confused with: {others}", (0, 0, 0, 2)), highlight=False)
    console.print()


def _parameters(effect: Effect) -> Table:
    table = Table.grid(padding=(0, 2))
    for parameter in effect.parameters:
        low, high = parameter.plausible
        table.add_row(
            f"[green]{parameter.name}[/green]",
            escape(f"[{parameter.unit}]"),
            f"neutral {_number(parameter.neutral)}",
            f"plausible {low:g} to {high:g}",
            parameter.description,
        )
    return table


def _number(value: float) -> str:
    return "inf" if isinf(value) else f"{value:g}"
