"""Measures exported policies against the NumPy policy: `python -m scripts.measure_export`.

Differences over a million observations, time of a decision and bytes, of each shipped policy; and
what weights of eight bits cost the first of each task on the frozen suites. Writes a dated table
and its numbers into results/.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from fish_env.envs.tasks import SIGNAL_TASKS
from robofish_agents.deployment import export_c, export_onnx, with_int8_weights
from robofish_agents.evaluation.results import evaluate
from robofish_agents.evaluation.suites import load_suite
from robofish_agents.policies import PretrainedPolicy, read_policy, shipped
from scripts.bench.harness import machine, versions
from scripts.exported import (
    CompiledPolicy,
    OnnxPolicy,
    bare_decision_us,
    decision_us,
    differences,
    observations,
)
from scripts.results import RESULTS, write_dated

FISH = 1000
TASKS = (*SIGNAL_TASKS, "station")
"""Tasks with shipped policies of their own."""
HEAD = (
    "| task | trained | policy | largest difference | RMS difference | decision (us) | bytes |\n"
    "| --- | --- | --- | --: | --: | --: | --: |\n"
)
SUITES = ("calm", "hard")


def measured(task: str, steps: int, folder: Path) -> list[dict[str, Any]]:
    """Rows of the forms of each shipped policy of a task; of all forms and times for the first."""
    return [
        {"task": task, "seed": file.stem, **row}
        for number, file in enumerate(shipped(task))
        for row in forms(file, task, steps, folder / file.stem, number == 0)
    ]


def forms(
    file: Path, task: str, steps: int, folder: Path, everything: bool
) -> list[dict[str, Any]]:
    """One row for each form of a policy; ONNX and C in float32 alone without ``everything``."""
    folder.mkdir(exist_ok=True)
    policy = read_policy(file)
    model, _ = export_onnx(policy, folder / f"{task}.onnx")
    header, _ = export_c(policy, folder / f"{task}.h")
    exact = {"ONNX": OnnxPolicy(model), "C, float32": CompiledPolicy(header)}
    others: dict[str, CompiledPolicy] = {}
    if everything:
        small, _ = export_c(policy, folder / f"{task}-int8.h", int8=True)
        others = {
            "C, float32, computed in float": CompiledPolicy(header, f"-D{task.upper()}_SINGLE"),
            "C, int8": CompiledPolicy(small),
        }
    exported = exact | others
    off = differences(policy, exported, task, steps, FISH)
    seen = next(iter(observations(task, 1, FISH)))
    numpy_us = decision_us(PretrainedPolicy(policy), seen)
    rows = [{"policy": "NumPy (the file)", "us": numpy_us, "bytes": file.stat().st_size}]
    for name, one in exported.items():
        bare = isinstance(one, CompiledPolicy)
        us = bare_decision_us(one, seen) if bare else decision_us(one, seen)
        size = one.flash_bytes() if bare else model.stat().st_size
        row = {"policy": name, "largest": off[name][0], "rms": off[name][1], "us": us}
        rows.append(row | {"bytes": size, "ratio": us / numpy_us})
    return rows


def swum(task: str) -> list[dict[str, Any]]:
    """Success of the policy as it was trained and with weights of eight bits."""
    policy = read_policy(shipped(task)[0])
    rows = []
    for name, one in (("float32", policy), ("int8", with_int8_weights(policy))):
        for suite in SUITES:
            result = evaluate(name, [PretrainedPolicy(one)], load_suite(suite), task, threads=1)
            numbers = {
                key: None if value is None else value.mean for key, value in result.metrics.items()
            }
            rows.append({"task": task, "weights": name, "suite": suite, "metrics": numbers})
    return rows


def page(rows: Sequence[dict[str, Any]], swims: Sequence[dict[str, Any]], count: int) -> str:
    """The tables as Markdown."""
    text = "# Exported policies\n\nDifferences in an action from the NumPy policy over "
    text += f"{count:,} observations for each row. Decisions in processor time.\n\n{HEAD}"
    for row in rows:
        off = [f"{row[key]:.1e}" if key in row else "-" for key in ("largest", "rms")]
        text += f"| {row['task']} | {row['seed']} | {row['policy']} | {' | '.join(off)} "
        text += f"| {row['us']:.1f} | {row['bytes']:,} |\n"
    if not swims:
        return text
    text += "\nSwims of the suites, 100 episodes each.\n\n"
    text += "| task | weights | suite | success (%) | depth RMSE (cm) | heading RMSE (rad) |\n"
    text += "| --- | --- | --- | --: | --: | --: |\n"
    for row in swims:
        m = row["metrics"]
        text += f"| {row['task']} | {row['weights']} | {row['suite']} "
        text += f"| {100 * m['success_rate']:.0f} | {100 * m['depth_rmse_m']:.2f} "
        text += f"| {m['heading_rmse_rad']:.4f} |\n"
    return text


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--steps", type=int, default=1000, help=f"observations in {FISH}s, a policy"
    )
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--task", choices=TASKS, help="policies of this task alone")
    options, console = parser.parse_args(arguments), Console()
    tasks = TASKS if options.task is None else (options.task,)
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for task in tasks:
            rows += measured(task, options.steps, Path(folder))
            console.print(page(rows, [], options.steps * FISH), markup=False)
    swims = [row for task in tasks if task in SIGNAL_TASKS for row in swum(task)]
    text = page(rows, swims, options.steps * FISH)
    about = {"machine": machine(), "steps": options.steps, "fish": FISH, "rows": rows}
    about |= {"swims": swims, "versions": versions(("numpy", "onnx", "onnxruntime"))}
    name = "export" if options.task is None else f"export-{options.task}"
    write_dated(options.out, name, about, text)
    console.print(text, markup=False)


if __name__ == "__main__":
    main()
