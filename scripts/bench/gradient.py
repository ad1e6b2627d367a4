"""How long the updates of `ppo-hold` take: batches, threads of PyTorch, `torch.compile`.

    python -m scripts.bench.gradient

Each line makes the same pass over one rollout, in turn with the others, several times over. Times
are of a pass over 4096 samples (ms): medians, and the least in brackets.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import torch

from robofish_agents.training.books import Books, Quiet
from robofish_agents.training.callback import Between
from robofish_agents.training.checkpoint import Progress
from robofish_agents.training.config import load_train_config
from robofish_agents.training.model import make_model
from robofish_agents.training.sb3_engine import Sb3Engine
from robofish_agents.training.stack import make_stack, seed_episodes

LINES = {
    "batches of 512": (512, 1, False),
    "batches of 1024": (1024, 1, False),
    "batches of 1024, torch.compile": (1024, 1, True),
    "batches of 1024, two threads": (1024, 2, False),
    "batches of 4096": (4096, 1, False),
}
"""Size of a batch, threads of PyTorch, compiled."""


def learner(batch: int) -> Any:
    """A learner of `ppo-hold` after one rollout, which makes one pass in an update."""
    config = load_train_config("ppo-hold")
    config = replace(config, ppo=replace(config.ppo, batch_size=batch, n_epochs=1))
    config = replace(config, total_steps=config.num_envs * config.ppo.n_steps)
    stack = make_stack(config)
    seed_episodes(stack, config)
    engine = Sb3Engine(config, stack)
    engine.model = make_model(config, stack)
    with tempfile.TemporaryDirectory() as folder:
        engine.log_to(Path(folder))
        books = Books(config, Progress(), Quiet(), dict, lambda: None, lambda *_: None)
        engine.model.learn(config.total_steps, callback=Between(books))
        engine.close()
    return engine.model


def timed(model: Any, threads: int) -> tuple[float, float]:
    """Processor time and wall-clock time of one pass (s)."""
    torch.set_num_threads(threads)
    started = time.process_time(), time.perf_counter()
    model.train()
    return time.process_time() - started[0], time.perf_counter() - started[1]


def main() -> None:
    """Measures, and prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    models, compiling = {}, {}
    torch.set_num_threads(1)
    for name, (batch, threads, compiled) in LINES.items():
        models[name] = model = learner(batch)
        if compiled:
            model.policy.evaluate_actions = torch.compile(model.policy.evaluate_actions)
        compiling[name] = timed(model, threads)[0]
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in LINES}
    for _ in range(rounds):
        for name, (_, threads, _) in LINES.items():
            times[name].append(timed(models[name], threads))
    print("| updates | processor ms | wall ms | first, processor s |\n| --- | --: | --: | --: |")
    for name, rows in times.items():
        spent = [[1000.0 * value for value in column] for column in zip(*rows, strict=True)]
        cells = " | ".join(f"{median(column):.1f} ({min(column):.1f})" for column in spent)
        print(f"| {name} | {cells} | {compiling[name]:.1f} |")


if __name__ == "__main__":
    main()
