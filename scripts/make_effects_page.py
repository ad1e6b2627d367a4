"""Writes docs/effects.md from the effects' declarations.

Run it as ``python -m scripts.make_effects_page``.
"""

from __future__ import annotations

from math import inf
from pathlib import Path

from fish_env.effects import catalogue
from fish_env.model.effect import SECTIONS, Effect, EffectParameter

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"

INTRODUCTION = """\
# Catalogue of effects

This page lists effects of real fish that the [baseline model](model.md) leaves out. `make docs`
writes it from the declarations of the effects. `robofish effects` prints a table of them.

Every effect is off at its neutral values and then changes nothing, to the last bit. Switch effects
on in a fish file, in Python, or in the environment:

```yaml
effects: {servo_lag: {time_constant: 0.05}, current: {north: 0.02}}
```

```python
import gymnasium as gym

from fish_env import Simulator

Simulator("zheng-2021-a", effects={"servo_lag": {"time_constant": 0.05}})
gym.make("fish_env:RoboticFish3D-v0", effects={"added_mass": {"surge": 0.2, "sway": 1.0}})
```

In the equations, *xi* is the tail angle and *cmd* the commanded angle. *V_rel* is the velocity
through the water and *omega* the angular velocity, both in the body frame. The column "plausible"
has the range that a robotic fish of 29 cm and 2 kg may show. The column "possible" has the range
that is accepted. Effects of one section that act on the same quantity act in the order of this
page. You can add [your own
effect](your-own.md#your-own-effect) in a Python file.

The first line of each entry says what can be observed.
"""
UNSEARCHED = "It can be simulated, and fitted on demand. `robofish diagnose` does not test it."


def page() -> str:
    """The page as Markdown."""
    effects = list(catalogue().values())
    parts = [INTRODUCTION, _overview(effects)]
    for section in SECTIONS:
        members = [effect for effect in effects if effect.section == section]
        parts += [f"## {section.capitalize()}\n"] * bool(members)
        parts += [_entry(effect) for effect in members]
    return "\n".join(parts)


def _overview(effects: list[Effect]) -> str:
    rows = []
    for section in SECTIONS:
        links = ", ".join(f"[`{e.name}`](#{e.name})" for e in effects if e.section == section)
        rows += [f"| [{section}](#{section}) | {links} |"] * bool(links)
    return "\n".join(["| section | effects |", "| --- | --- |", *rows, ""])


def _entry(effect: Effect) -> str:
    lines = [
        f"### {effect.name}\n",
        f"{effect.summary}\n",
        f"    {effect.equation}\n",
        "| parameter | unit | neutral | plausible | possible | meaning |",
        "| --- | --- | --- | --- | --- | --- |",
        *(_row(parameter) for parameter in effect.parameters),
        "",
    ]
    if effect.confusable_with:
        others = ", ".join(f"[`{name}`](#{name})" for name in effect.confusable_with)
        lines.append(f"Easily confused with {others}.\n")
    if not effect.diagnosed:
        lines.append(f"{UNSEARCHED}\n")
    return "\n".join([*lines, f"Source: {effect.source.rstrip('.')}.\n"])


def _row(parameter: EffectParameter) -> str:
    low, high = parameter.plausible
    return (
        f"| `{parameter.name}` | {parameter.unit} | {parameter.neutral:g} | {low:g} to {high:g} "
        f"| {_possible(parameter)} | {_cell(parameter.description)} |"
    )


def _possible(parameter: EffectParameter) -> str:
    if (parameter.lower, parameter.upper) == (-inf, inf):
        return "any"
    return f"{parameter.lower:g} to {parameter.upper:g}"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")
