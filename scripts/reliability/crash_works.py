"""What the crash rig kills: a training, a diagnosis, a suite of hidden effects."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fish_env.diagnosis import diagnose
from fish_env.files import write_bytes
from robofish_agents.policies import read_policy
from robofish_agents.training.books import Quiet
from robofish_agents.training.config import Evaluation, Ppo, TrainConfig
from robofish_agents.training.run import CHECKPOINT, CONFIG, POLICY, train
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
    """

    name: str
    promise: str
    kills_each = 3

    @abstractmethod
    def run(self, folder: Path) -> None:
        """Does it, or goes on with it."""

    @abstractmethod
    def outcome(self, folder: Path) -> Outcome:
        """What a finished folder holds, without times and dates."""

    def damage(self, folder: Path, whole: Path) -> list[str]:
        """What is damaged in a folder right after a kill, in words."""
        return []


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
        network = read_policy(folder / POLICY).network
        arrays = [network.mean, network.scale, *network.weights, *network.biases]
        rows = (folder / "evaluations.csv").read_text(encoding="utf-8").splitlines()
        timed = [i for i, key in enumerate(rows[0].split(",")) if key.endswith("_s")]
        return {
            "policy": [_sum(np.ascontiguousarray(array).tobytes()) for array in arrays],
            "evaluations": [
                [cell for i, cell in enumerate(row.split(",")) if i not in timed] for row in rows
            ],
        }


class Diagnosis(Work):
    """`robofish diagnose --out`, begun anew after each kill, beside a picture of the user's."""

    name = "diagnose"
    kills_each = 6
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


def _sum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


WORKS: dict[str, Callable[[], Work]] = {work.name: work for work in (Training, Diagnosis, Suite)}
"""By name."""
