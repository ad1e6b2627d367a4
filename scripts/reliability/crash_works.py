"""What the crash rig kills: a training, a diagnosis, a suite of hidden effects, a sweep."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from fish_env.diagnosis import diagnose
from fish_env.files import write_bytes, write_text
from robofish_agents.policies import read_policy
from robofish_agents.training.books import Quiet
from robofish_agents.training.config import Evaluation, Ppo, TrainConfig
from robofish_agents.training.run import CHECKPOINT, CONFIG, EVALUATIONS, POLICY, train
from scripts import benchmark_diagnosis
from tests.diagnosis.small_cases import small_case
from tests.hidden.stubs import all_knowing

Outcome = dict[str, Any]
STAND_IN = f"{all_knowing.__module__}:{all_knowing.__name__}"


class Work(ABC):
    """Something that runs in a folder, may be killed, and is started again.

    Attributes:
        name: short name.
        promise: what is promised to be equal, in words.
        kills_each: kills in one folder before it may end.
        begins_anew: whether each start does all of it again.
        elsewhere: whether other processes than the one that is started do the work and write.
    """

    name: str
    promise: str
    kills_each = 3
    begins_anew = False
    elsewhere = False

    @abstractmethod
    def run(self, folder: Path) -> None:
        """Does it, or goes on with it."""

    @abstractmethod
    def outcome(self, folder: Path) -> Outcome:
        """What a finished folder holds, without times and dates."""

    def damage(self, folder: Path, whole: Path) -> list[str]:
        """What is damaged in a folder right after a kill, in words."""
        return []


def trained(folder: Path) -> Outcome:
    """Checksums of the arrays of a run folder's policy, and its evaluations without times."""
    network = read_policy(folder / POLICY).network
    arrays = [network.mean, network.scale, *network.weights, *network.biases]
    return {
        "policy": [_sum(np.ascontiguousarray(array).tobytes()) for array in arrays],
        "evaluations": timeless(folder / EVALUATIONS),
    }


def timeless(table: Path) -> list[list[str]]:
    """The rows of a table, without the columns that hold times."""
    rows = [row.split(",") for row in table.read_text(encoding="utf-8").splitlines()]
    kept = [i for i, key in enumerate(rows[0]) if not key.endswith("_s")]
    return [[row[i] for i in kept] for row in rows]


class Training(Work):
    """`robofish train` with many checkpoints, resumed."""

    name = "train"
    promise = "weights, normalisation and evaluations, bit for bit"
    config = TrainConfig(
        "crash", "ppo", "hold", 3072, num_envs=8, disturbances=("calm", "noisy"),
        ppo=Ppo(n_steps=16, batch_size=128, n_epochs=1),
        evaluation=Evaluation(every=600, episodes=2), checkpoint_every=200,
    )  # fmt: skip

    def run(self, folder: Path) -> None:
        """Trains; goes on if there is something to go on with."""
        resume = (folder / CHECKPOINT).exists() or (folder / CONFIG).exists()
        train(self.config, folder, Quiet(), resume=resume)

    def outcome(self, folder: Path) -> Outcome:
        """Checksums of the policy's arrays, and the evaluations without times."""
        return trained(folder)


class Diagnosis(Work):
    """`robofish diagnose --out`, begun anew after each kill, beside a picture of the user's."""

    name = "diagnose"
    kills_each = 6
    begins_anew = True
    promise = "every file whole, old or new, after each kill; the answer equal but for its runtime"
    picture = b"a picture that the user put there"

    def run(self, folder: Path) -> None:
        """Diagnoses three short runs, which the first process beside this one makes."""
        data, mine = folder.parent / "data", folder / "out" / "figures" / "mine.png"
        if not data.exists():
            small_case(data, {}, runs=3, duration=4.0)
        if not mine.exists():
            mine.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(mine, self.picture)
        diagnose(data, folder / "out", quick=True)

    def outcome(self, folder: Path) -> Outcome:
        """The answer, the names of the files, and the user's picture."""
        out = folder / "out"
        answer = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
        answer.pop("runtime_s")
        files = sorted(
            str(f.relative_to(out)) for f in out.rglob("*") if not f.name.startswith(".")
        )
        picture = (out / "figures" / "mine.png").read_bytes()
        return {"answer": json.dumps(answer), "files": files, "picture": picture}

    def damage(self, folder: Path, whole: Path) -> list[str]:
        """Files that are no whole JSON, SVG or HTML."""
        ends = {".json": b"}", ".html": b"</html>", ".svg": b"</svg>"}
        return [
            f"{file.name} is cut short"
            for file in folder.glob("out/**/*")
            if file.suffix in ends and not file.name.startswith(".")
            if not file.read_bytes().rstrip().endswith(ends[file.suffix])
        ]


class Suite(Work):
    """`scripts/benchmark_diagnosis.py`: cases are kept as they end, and not made again."""

    name = "suite"
    promise = "every row and the summary, bit for bit"

    def run(self, folder: Path) -> None:
        """Six cases, judged by a stand-in for the diagnosis that knows the answers."""
        benchmark_diagnosis.main(
            [
                "--tiers",
                "poor,null",
                "--limit",
                "6",
                "--processes",
                "1",
                "--diagnose",
                STAND_IN,
                "--work",
                str(folder / "work"),
                "--out",
                str(folder / "out"),
            ]
        )

    def outcome(self, folder: Path) -> Outcome:
        """The rows of all cases and what is published, without date and commit."""
        (result,) = (folder / "out").glob("*.json")
        content = json.loads(result.read_text(encoding="utf-8"))
        rows = {
            f"work {file.name}": _sum(file.read_bytes())
            for file in folder.glob("work/**/*.json")
            if not file.name.startswith(".")
        }
        return rows | {k: v for k, v in content.items() if k not in ("date", "commit")}


class Sweep(Work):
    """`robofish sweep` over two seeds; each start continues what the last one left."""

    name = "sweep"
    kills_each = 5
    promise = "every policy and evaluation, bit for bit, and the table"
    elsewhere = True
    config = replace(Training.config, name="crash", total_steps=6144)

    def run(self, folder: Path) -> None:
        """Trains what is not finished; Ray keeps its own files beside the folders."""
        # Ray must not be imported before this process is forked.
        from fish_env.cluster import ClusterSettings
        from robofish_agents.sweep.plan import plan
        from robofish_agents.sweep.run import run_sweep

        file = folder / "crash.yaml"
        if not file.exists():
            write_text(file, yaml.safe_dump(self.config.tree()))
        temp = folder.parent / "ray"
        run_sweep(plan(file, "0,1"), folder / "out", ClusterSettings(cpus=1, temp=temp))

    def outcome(self, folder: Path) -> Outcome:
        """The run folders and the table."""
        runs = {file.parent.name: trained(file.parent) for file in folder.glob("out/*/policy.npz")}
        return runs | {"table": timeless(folder / "out" / "sweep.csv")}


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


WORKS: dict[str, Callable[[], Work]] = {
    work.name: work for work in (Training, Diagnosis, Suite, Sweep)
}
"""By name."""
