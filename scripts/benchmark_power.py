"""How often an effect of a chosen size is found, against what the diagnosis publishes.

For each design (a fish, schedules, a size of the noise) the smallest detectable sizes are published
from runs without any effect. Then the same design is swum again, with other noise and an effect of
some multiple of its published size, and screened: the baseline refit and the largest of all tests,
which is the cheap part of a diagnosis. A few of these data sets are diagnosed in full.

Each finished data set is kept, so a stopped run goes on where it was:

    python scripts/benchmark_power.py --designs 4
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from scripts.one_thread import ONE_THREAD  # noqa: E402

os.environ.update(ONE_THREAD)

from rich.progress import track  # noqa: E402

from scripts.power import report  # noqa: E402
from scripts.power.looks import (  # noqa: E402
    Target,
    allowed,
    diagnosed,
    with_effect,
    without_effect,
)
from scripts.power.signals import agreement  # noqa: E402
from scripts.results import RESULTS, kept  # noqa: E402

SIZES = (0.6, 0.8, 1.0, 1.4)
FEW = (1.0, 1.4)
WHOLE = 1.4
"""Multiple at which whole diagnoses are made."""
TARGETS = (
    Target("frequency_scale", "scale", -1.0),
    Target("added_mass", "yaw"),
    Target("linear_drag", "surge"),
    Target("buoyancy_offset", "mass"),
    Target("current", "north"),
    Target("gyro_bias", "r"),
    Target("sensor_delay", "delay"),
)
AGAIN = TARGETS[:3]
"""Those that are measured under twice the noise, too."""
FEWER = (Target("position_scale", "scale"),)
"""Measured at two sizes of two designs: that its signal stays where a run starts is what counts."""


@dataclass(frozen=True)
class Look:
    """One data set with an effect."""

    target: Target
    multiple: float
    design: int
    repeat: int
    noise: str
    whole: bool = False

    @property
    def file(self) -> str:
        """Where its result is kept."""
        kind = "whole" if self.whole else "look"
        return f"{kind}-{self.noise}-{self.design}-{self.target.name}-{self.multiple:g}.json"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parse(arguments)
    options.work.mkdir(parents=True, exist_ok=True)
    todo = list(looks(options.designs, options.again))
    if options.only:
        todo = [look for look in todo if look.target.effect in options.only.split(",")]
    if options.finished:
        todo = [look for look in todo if (options.work / look.file).exists()]
    begin = time.monotonic()
    rows = [do(look, options.work) for look in track(todo, f"{len(todo)} data sets")]
    nothing = [with_limits(file) for file in sorted(options.work.glob("nothing-*.json"))]
    sizes = nothing[0]["published"]
    signals = kept(options.work / "signals.json", lambda: agreement(nothing[0]["design"], sizes))
    print(f"{time.monotonic() - begin:.0f} s")
    summary = report.summarise(rows, nothing, signals)
    report.write({**summary, "rows": rows, "without_effect": nothing}, options.out)
    report.draw(summary, options.picture)


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--designs", type=int, default=4, help="fish and schedules under the nominal noise")
    add("--again", type=int, default=3, help="of them under twice the noise")
    add("--only", help="effects, separated by commas; default: all")
    add("--finished", action="store_true", help="only sum up what is finished so far")
    add("--work", type=Path, default=ROOT / "out" / "benchmark-power")
    add("--out", type=Path, default=RESULTS, help="folder of the dated result")
    add("--picture", type=Path, default=ROOT / "docs" / "images" / "power.png")
    return parser.parse_args(arguments)


def looks(designs: int, again: int) -> Iterator[Look]:
    """All data sets, one design after the other, so that an early stop has seen all effects."""
    for design in range(designs):
        yield from at_sizes(TARGETS, SIZES, design, "nominal", 1)
        if design < again:
            yield from at_sizes(AGAIN, SIZES, design, "double", 101)
        if design < 2:
            yield from at_sizes(FEWER, FEW, design, "nominal", 201)
    for number, target in enumerate(TARGETS):
        yield Look(target, WHOLE, 0, 301 + number, "nominal", whole=True)


def at_sizes(
    targets: Sequence[Target], sizes: Sequence[float], design: int, noise: str, first: int
) -> Iterator[Look]:
    """Every target at every size, each with noise of its own, numbered from the first on."""
    pairs = [(target, size) for target in targets for size in sizes]
    for number, (target, size) in enumerate(pairs):
        yield Look(target, size, design, first + number, noise)


def do(look: Look, work: Path) -> dict[str, Any]:
    """One data set; a finished one is read back."""
    design, noise = look.design, look.noise
    nothing = kept(work / f"nothing-{noise}-{design}.json", lambda: without_effect(design, noise))
    size = nothing["published"][look.target.name]
    make = diagnosed if look.whole else with_effect
    return kept(
        work / look.file,
        lambda: make(look.target, look.multiple, size, design, look.repeat, noise),
    )


def with_limits(file: Path) -> dict[str, Any]:
    """What is published of a design, and what its data allow."""
    nothing = json.loads(file.read_text(encoding="utf-8"))
    design, noise = nothing["design"], nothing["noise"]
    name = file.with_name(file.name.replace("nothing", "limits"))
    return {**nothing, "limits": kept(name, lambda: allowed(design, noise, nothing))}


if __name__ == "__main__":
    main()
