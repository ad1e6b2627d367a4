"""Measures exported policies against the NumPy policy: `python -m scripts.measure_export`.

Differences over a million observations, time of a decision and bytes, of one shipped policy for
each task; and what weights of eight bits cost on the frozen suites. Writes a dated table and its
numbers into results/.
"""

from __future__ import annotations

import argparse
import datetime
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from agents.deployment import export_c, export_onnx, with_int8_weights
from agents.evaluation.results import evaluate
from agents.evaluation.suites import load_suite
from agents.policies import PretrainedPolicy, read_policy, shipped
from fish_env.envs.tasks import TASKS
from scripts.bench.harness import machine, versions
from scripts.exported import (
    CompiledPolicy,
    OnnxPolicy,
    bare_decision_us,
    decision_us,
    differences,
    observations,
)

ROOT = Path(__file__).resolve().parents[1]
FISH = 1000
HEAD = (
    "| task | policy | largest difference | RMS difference | decision (us) | bytes |\n"
    "| --- | --- | --: | --: | --: | --: |\n"
)
SUITES = ("calm", "hard")


def measured(task: str, steps: int, folder: Path) -> list[dict[str, Any]]:
    """One row for each form of the first shipped policy of a task."""
    file = shipped(task)[0]
    policy = read_policy(file)
    model, _ = export_onnx(policy, folder / f"{task}.onnx")
    header, _ = export_c(policy, folder / f"{task}.h")
    small, _ = export_c(policy, folder / f"{task}-int8.h", int8=True)
    compiled = {
        "C, float32": CompiledPolicy(header),
        "C, float32, computed in float": CompiledPolicy(header, f"-D{task.upper()}_SINGLE"),
        "C, int8": CompiledPolicy(small),
    }
    exported = {"ONNX": OnnxPolicy(model), **compiled}
    exact = {name: exported[name] for name in ("ONNX", "C, float32")}
    off = differences(policy, exact, task, steps, FISH)
    others = {name: one for name, one in exported.items() if name not in exact}
    off |= differences(policy, others, task, max(2, steps // 10), FISH)
    seen = next(iter(observations(task, 1, FISH)))
    sizes = {"ONNX": model.stat().st_size}
    sizes |= {name: one.flash_bytes() for name, one in compiled.items()}
    numpy_us = decision_us(PretrainedPolicy(policy), seen)
    rows = [{"policy": "NumPy (the file)", "us": numpy_us, "bytes": file.stat().st_size}]
    for name, one in exported.items():
        bare = isinstance(one, CompiledPolicy)
        us = bare_decision_us(one, seen) if bare else decision_us(one, seen)
        row = {"policy": name, "largest": off[name][0], "rms": off[name][1], "us": us}
        rows.append(row | {"bytes": sizes[name], "ratio": us / numpy_us})
    return [{"task": task, **row} for row in rows]


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
    text += f"{count:,} observations a task (a tenth for the last two rows).\n\n{HEAD}"
    for row in rows:
        off = [f"{row[key]:.1e}" if key in row else "-" for key in ("largest", "rms")]
        text += f"| {row['task']} | {row['policy']} | {' | '.join(off)} | {row['us']:.1f} "
        text += f"| {row['bytes']:,} |\n"
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
    parser.add_argument("--steps", type=int, default=500, help=f"observations in {FISH}s, a task")
    parser.add_argument("--out", type=Path, default=ROOT / "results")
    options, console = parser.parse_args(arguments), Console()
    today = datetime.date.today().isoformat()
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for task in TASKS:
            rows += measured(task, options.steps, Path(folder))
            console.print(page(rows, [], options.steps * FISH), markup=False)
    swims = [row for task in TASKS for row in swum(task)]
    text = page(rows, swims, options.steps * FISH)
    about = {"date": today, "machine": machine(), "rows": rows, "swims": swims}
    about["versions"] = versions(("numpy", "onnx", "onnxruntime"))
    (options.out / f"export-{today}.md").write_text(text, "utf-8")
    (options.out / f"export-{today}.json").write_text(json.dumps(about, indent=1) + "\n", "utf-8")
    console.print(text, markup=False)


if __name__ == "__main__":
    main()
