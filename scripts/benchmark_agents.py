"""Measures the shipped agents on all suites for `robofish leaderboard`: `make benchmark-agents`.

Each finished combination is kept, so a stopped run goes on where it was:

    python -m scripts.benchmark_agents --agents pid,mppi

A combination is done again when the suite, the agent's code or its policies have changed.
"""

from __future__ import annotations

import argparse
import ast
import datetime
import hashlib
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from robofish_agents.evaluation.leaderboard import SHIPPED
from robofish_agents.evaluation.results import Result, evaluate, read_results, write_results
from robofish_agents.evaluation.suites import Suite, load_suite, suite_names
from robofish_agents.registry import load_agents
from scripts.bench.harness import machine

ROOT = Path(__file__).resolve().parents[1]
AGENTS = ("pid", "mppi", "pretrained")
OWN = "agents/robofish_agents"
SOURCES = {
    "pid": (f"{OWN}/controllers/pid.py", f"{OWN}/controllers/seen.py", "configs/controllers"),
    "mppi": (f"{OWN}/controllers/mppi.py", f"{OWN}/controllers/prediction.py"),
    "pretrained": (f"{OWN}/pretrained/*/*.npz",),
}
"""What an agent's numbers depend on: files, folders, patterns."""
GUIDANCE = ("fish_env/envs/guidance.py", "fish_env/envs/guides.py", "fish_env/envs/tasks/*.py")
"""What those of paths and places depend on as well."""
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def fingerprint(agent: str, suite: str) -> str:
    """Changes with anything that the numbers depend on, but the environment."""
    places = (*SOURCES[agent], f"configs/benchmarks/{suite}.yaml", f"{OWN}/evaluation/metrics.py")
    if "/" in suite:
        places += (f"{OWN}/evaluation/goal_metrics.py", *GUIDANCE)
    digest = hashlib.sha256()
    for place in places:
        pattern = f"{place}/**/*" if (ROOT / place).is_dir() else place
        for file in sorted(ROOT.glob(pattern)):
            if file.is_file() and file.suffix not in (".pyc", ".md"):
                digest.update(content(file))
    return digest.hexdigest()[:12]


def content(file: Path) -> bytes:
    """The bytes of a file; of Python without docstrings, on which no number depends."""
    if file.suffix != ".py":
        return file.read_bytes()
    source = file.read_text(encoding="utf-8")
    lines: list[str | None] = list(source.splitlines())
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            for line in range(first.lineno - 1, first.end_lineno or first.lineno):
                lines[line] = None
    return "\n".join(line for line in lines if line is not None).encode()


def fingerprints(agents: Sequence[str]) -> dict[str, dict[str, str]]:
    """Agent -> suite -> fingerprint."""
    return {
        agent: {suite: fingerprint(agent, suite) for suite in suite_names()} for agent in agents
    }


def measured(agents: Sequence[str], work: Path, console: Console) -> Iterator[Result]:
    """All combinations, those that are new being measured now."""
    for suite in map(load_suite, suite_names()):
        for task in suite.tasks:
            for agent in agents:
                yield kept(agent, suite, task, work, console)


def kept(agent: str, suite: Suite, task: str, work: Path, console: Console) -> Result:
    name = suite.name.replace("/", "-")
    file = work / f"{agent}-{name}-{task}-{fingerprint(agent, suite.name)}.json"
    if not file.is_file():
        begun = time.monotonic()
        result = evaluate(agent, load_agents(agent, task), suite, task)
        write_results(file, [result])
        took = time.monotonic() - begun
        success = result.metrics["success_rate"]
        rate = "-" if success is None else f"{success.mean:.2f}"
        console.print(f"{agent} {suite.name} {task}: success {rate} ({took:.0f} s)")
    (result,) = read_results(file)
    return result


def decision_times(agent: str, decisions: int = 400) -> dict[str, float]:
    """Milliseconds a decision takes for one fish: by the clock, and by processor time."""
    suite = load_suite("calm")
    (controller, *_) = load_agents(agent, "hold")
    env = suite.make("hold", 1)
    observations, _ = env.reset(seed=suite.seed)
    controller.reset(1)
    controller.act(observations)
    controller.reset(1)
    wall, process = [], []
    for _ in range(decisions):
        before, used = time.perf_counter(), time.process_time()
        action = controller.act(observations)
        wall.append(1000.0 * (time.perf_counter() - before))
        process.append(1000.0 * (time.process_time() - used))
        observations, *_ = env.step(action)
    return {
        f"{clock}_ms_{name}": round(float(np.quantile(values, share)), 3)
        for clock, values in (("wall", wall), ("process", process))
        for name, share in (("median", 0.5), ("p99", 0.99))
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("--agents", default=",".join(AGENTS), help=f"some of {', '.join(AGENTS)}")
    add("--work", type=Path, default=ROOT / "out" / "benchmark-agents")
    add("--out", type=Path, default=SHIPPED)
    options, console = parser.parse_args(arguments), Console()
    agents = options.agents.split(",")
    options.work.mkdir(parents=True, exist_ok=True)
    results = list(measured(agents, options.work, console))
    times = {agent: decision_times(agent) for agent in agents}
    console.print(json.dumps(times, indent=1))
    today = datetime.date.today().isoformat()
    more = {"date": today, "machine": machine(), "decision_times": times}
    write_results(options.out, results, fingerprints=fingerprints(agents), **more)
    console.print(f"written: {options.out}")


if __name__ == "__main__":
    main()
