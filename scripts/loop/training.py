"""Trains a policy on what somebody knows of a fish, and judges it on the fish itself.

Everything finished is kept under a name that changes with whatever it depends on, so that a
stopped run goes on where it was and nothing stale is ever read.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from robofish_agents.controllers.pid import PIDController
from robofish_agents.evaluation.metrics import METRICS
from robofish_agents.evaluation.record import swim_suite
from robofish_agents.policies import PretrainedPolicy, shipped
from robofish_agents.registry import Agent
from robofish_agents.training.books import Quiet
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.run import train
from scripts.loop.declaration import Declaration
from scripts.loop.measuring import Known
from scripts.results import kept

BASELINE, RANDOMISED = "baseline", "randomised"
EXTENDED, POSTERIOR, TRUTH = "extended", "posterior", "truth"
ARMS: dict[str, str] = {
    BASELINE: "the printed fish",
    RANDOMISED: "fish around it, another in each episode",
    EXTENDED: "the extended model",
    POSTERIOR: "draws from its posterior, another in each episode",
    TRUTH: "the hidden fish itself",
}
"""What a policy is trained on. Without an extended model the designer only has the printed one."""
WITHOUT_MEASUREMENTS = (BASELINE, RANDOMISED)
"""Arms whose policies are the same for all hidden fish."""
PID, SHIPPED = "PID", "shipped"
"""Who swims beside them, and was trained on none of these."""
Means = Mapping[str, Mapping[str, float]]
"""Task -> metric -> mean over the episodes."""


@dataclass(frozen=True)
class Score:
    """One policy judged on one hidden fish.

    Attributes:
        fish: name of the hidden fish.
        arm: what it was trained on.
        seed: of the training.
        trained_on: the arm whose policy it is; ``baseline`` where there is no extended model.
        means: what it reached.
        cpu_s: processor time of training and judging spent for it; 0 for a policy trained before.
    """

    fish: str
    arm: str
    seed: int
    trained_on: str
    means: Means
    cpu_s: float


def fish_options(declared: Declaration, known: Known, arm: str) -> dict[str, Any]:
    """Options of the environment to train in."""
    if arm == TRUTH:
        return {"fish": str(known.true)}
    if arm == RANDOMISED:
        return {"fish": declared.printed, "randomization": declared.spread}
    if arm == BASELINE or known.extended is None:
        return {"fish": declared.printed}
    drawn = {"randomization": "posterior"} if arm == POSTERIOR else {}
    return {"fish": str(known.extended), **drawn}


def scored(declared: Declaration, known: Known, arm: str, seed: int, work: Path) -> Score:
    """Trains and judges, as far as that is not done yet."""
    options = fish_options(declared, known, arm)
    config = replace(declared.recipe, seed=seed, environment=options)
    policy, mark = work / "policies" / f"{seed}-{_mark(config)}", _judged(declared, known)
    file = work / "scores" / f"{known.name}-{arm}-{policy.name}-{mark}.json"

    def row() -> dict[str, Any]:
        begun = time.process_time()
        outcome = train(config, policy, Quiet(), resume=True)
        means = judge(declared, known, PretrainedPolicy.load(outcome.policy))
        trained_on = BASELINE if options == {"fish": declared.printed} else arm
        return {
            "fish": known.name, "arm": arm, "seed": seed, "trained_on": trained_on,
            "means": means, "cpu_s": round(time.process_time() - begun, 1),
        }  # fmt: skip

    return Score(**kept(file, row))


def judge_beside(declared: Declaration, known: Known) -> dict[str, Means]:
    """What the PID controller reaches, and the shipped policies of the first task in the mean."""
    policies = [PretrainedPolicy.load(file) for file in shipped(declared.tasks[0])]
    rows = [judge(declared, known, policy) for policy in policies]
    shipped_means = {
        task: {key: float(np.mean([row[task][key] for row in rows])) for key in declared.metrics}
        for task in declared.tasks
    }
    return {PID: judge(declared, known, PIDController()), SHIPPED: shipped_means}


def judge(declared: Declaration, known: Known, agent: Agent) -> Means:
    """Means over the episodes of the suite, swum by the hidden fish."""
    environment = {**declared.suite.environment, "fish": str(known.true)}
    suite = replace(declared.suite, environment=environment)
    means = {}
    for task in declared.tasks:
        record = swim_suite(suite, task, agent, threads=1)
        means[task] = {key: float(np.mean(METRICS[key](record))) for key in declared.metrics}
    return means


def _mark(config: TrainConfig) -> str:
    """Changes with the training and with what stands in the fish's file, not with its place."""
    tree = {**config.tree(), "environment": {**config.environment}}
    file = Path(str(tree["environment"]["fish"]))
    if file.is_file():
        tree["environment"]["fish"] = file.read_text(encoding="utf-8")
    return _digest(tree)


def _judged(declared: Declaration, known: Known) -> str:
    suite = declared.suite
    about = (suite.name, suite.version, suite.episodes, declared.tasks, declared.metrics)
    return _digest([about, known.true.read_text(encoding="utf-8")])


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:10]
