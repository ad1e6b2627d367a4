"""`robofish info`: a fish at a glance."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console, Group
from rich.markup import escape
from rich.panel import Panel
from rich.rule import Rule
from rich.table import Table

from fish_env.commands.numbers import write_json
from fish_env.effects.extended import build_model
from fish_env.files import check_outputs
from fish_env.params import FishParams, fish_files, list_fish, load_fish
from fish_env.simulator import Simulator
from fish_env.studies import portrait

PARAMETER_FIELDS = ("value", "unit", "prior_sd", "status", "source")
DEG = 180.0 / np.pi


def print_info(
    console: Console,
    fish_name: str,
    trust_effects: bool = False,
    json_file: Path | None = None,
) -> None:
    """Prints parameters, trim, stability, reach, speeds and effects of a fish.

    Args:
        console: Where they go.
        fish_name: A preset's name, or a parameter file.
        trust_effects: Run the effect files that the fish's file names.
        json_file: File for all numbers.
    """
    fish = load_fish(fish_name, trust_effects)
    check_outputs([json_file], fish_files(fish))
    simulator = Simulator(fish)
    console.print(_heading(fish))
    console.print(_parameters(fish))
    _print_sources(console, fish)
    _print_balance(console, simulator)
    console.print(Rule("Speed in m/s, steady, over amplitude and frequency", align="left"))
    with console.status("swimming"):
        speeds = portrait.cruise_speeds(fish)
    console.print(_speeds(speeds))
    _print_effects(console, fish)
    if json_file is not None:
        write_json(console, json_file, _numbers(fish, simulator, speeds))


def _numbers(fish: FishParams, simulator: Simulator, speeds: np.ndarray) -> dict[str, Any]:
    parameters = {
        path: {name: getattr(fish.info(path), name) for name in PARAMETER_FIELDS}
        for path in fish.values()
    }
    return {
        "fish": fish.name,
        "parameters": parameters,
        "block_displacement_reach_m": simulator.crank.reach,
        "static_margins": dataclasses.asdict(portrait.static_margins(simulator)),
        "speeds_m_s": {
            "amplitudes_deg": portrait.AMPLITUDES_DEG,
            "frequencies_hz": portrait.FREQUENCIES_HZ,
            "speeds": speeds,
        },
        "effects": fish.effects,
    }


def _heading(fish: FishParams) -> Panel:
    surplus = 1000.0 * (fish.get("mass.buoyancy") - fish.get("mass.total"))
    floats = "neutral" if abs(surplus) < 1e-6 else ("floats" if surplus > 0 else "sinks")
    lines = [
        f"file      {escape(str(fish.source_file))}",
        f"mass      {fish.get('mass.total'):g} kg, buoyancy {surplus:+.2f} g ({floats})",
        f"presets   {', '.join(list_fish())}",
    ]
    return Panel(Group(*lines), title=f"[bold]{escape(fish.name)}[/bold]", title_align="left")


def _sources(fish: FishParams) -> dict[str, int]:
    """Sources of all values, numbered in order of appearance."""
    texts = dict.fromkeys(fish.info(path).source for path in fish.values())
    return {text: number for number, text in enumerate(texts, 1)}


def _parameters(fish: FishParams) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column("parameter", no_wrap=True)
    for name in ("value", "prior sd"):
        table.add_column(name, justify="right", no_wrap=True)
    for name in ("unit", "status and source"):
        table.add_column(name, no_wrap=True)
    numbers, section = _sources(fish), ""
    for path in fish.values():
        info, (group, _, name) = fish.info(path), path.partition(".")
        if group != section:
            section = group
            table.add_section()
            table.add_row(f"[bold]{group}[/bold]")
        sd = f"{info.prior_sd:.2g}" if info.prior_sd else "known"
        origin = escape(f"{info.status} [{numbers[info.source]}]")
        table.add_row(f"  {escape(name)}", f"{info.value:g}", sd, info.unit, origin)
    for name, curve in fish.tables().items():
        table.add_row(name, "table", "", "-", escape(curve.source))
    return table


def _print_sources(console: Console, fish: FishParams) -> None:
    for text, number in _sources(fish).items():
        console.print(f"[{number}] {text}", style="dim", highlight=False, markup=False)
    console.print("prior sd: one standard deviation before any data\n", style="dim")


def _print_balance(console: Console, simulator: Simulator) -> None:
    console.print(Rule("Trim at rest, tail still", align="left"))
    low, high = simulator.crank.reach
    reach = np.linspace(low, high, 5)
    pitches = [portrait.trim_pitch(simulator, dd) for dd in sorted({*reach, 0.0})]
    rolls = [portrait.trim_roll(simulator, a / DEG) for a in portrait.BRACKET_ANGLES_DEG]
    console.print(_trim_table("block displacement", "cm", 100.0, "pitch", pitches))
    console.print(_trim_table("block angle", "deg", DEG, "roll", rolls))
    console.print(
        f"the crank reaches displacements of {100 * low:.2f} to {100 * high:.2f} cm\n",
        highlight=False,
    )
    console.print(Rule("Static stability", align="left"))
    _print_margins(console, portrait.static_margins(simulator))


def _trim_table(
    block: str, unit: str, factor: float, angle: str, trims: list[portrait.Trim]
) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1), show_header=False)
    table.add_row(f"{block} ({unit})", *(f"{factor * t.block:z.2f}" for t in trims))
    values = (f"[bold]{DEG * t.angle:z.1f}[/bold]" for t in trims)
    table.add_row(f"{angle} (deg)", *values)
    axis = 0 if angle == "pitch" else 1
    centres = (f"{1000 * t.centre[axis]:z.2f}" for t in trims)
    table.add_row(f"centre of mass {'xyz'[axis]} (mm)", *centres, style="dim")
    return table


def _print_margins(console: Console, margins: portrait.StaticMargins) -> None:
    def word(value: float) -> str:
        return "stable" if value > 0 else "unstable"

    lines = [
        f"righting moment      {1000 * margins.righting / DEG:.3g} mN m per degree "
        f"({word(margins.righting)})",
        f"static margin, pitch {1000 * margins.pitch:+.1f} mm "
        f"({word(margins.pitch)} in the flow alone)",
        f"static margin, yaw   {1000 * margins.yaw:+.1f} mm ({word(margins.yaw)}, tail held still)",
    ]
    if np.isfinite(margins.critical_speed):
        lines.append(
            f"above {margins.critical_speed:.2f} m/s the flow pitches the fish faster than "
            "gravity rights it"
        )
    console.print("\n".join(lines) + "\n", highlight=False)


def _speeds(speeds: np.ndarray) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("A1 (deg) \\ f1 (Hz)")
    for frequency in portrait.FREQUENCIES_HZ:
        table.add_column(f"{frequency:g}", justify="right")
    for amplitude, row in zip(portrait.AMPLITUDES_DEG, speeds, strict=True):
        table.add_row(f"{amplitude:g}", *(f"{value:.3f}" for value in row))
    return table


def _print_effects(console: Console, fish: FishParams) -> None:
    console.print(Rule("Effects in the file", align="left"))
    model = build_model(fish)
    if not fish.effects:
        console.print("none: the baseline model; `robofish effects` lists what can be added")
    for name in fish.effects:
        values = model.effects.get(name)
        text = ", ".join(f"{key} {value:g}" for key, value in (values or {}).items())
        console.print(
            f"{name}: {text or 'at its neutral values, so off'}", highlight=False, markup=False
        )
