"""Trains the trials of a sweep with Ray Tune, each into an ordinary run folder."""

from __future__ import annotations

import csv
import io
import os
import socket
import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import yaml

from fish_env.cluster import ClusterSettings, check_version, connected
from fish_env.errors import ConfigError
from fish_env.files import check_first_line, check_no_links, write_rows, write_text
from fish_env.reading import MOST_TABLE_BYTES, Unreadable, read_text, shown
from fish_env.version import VERSION, WRITTEN_BY, stamped
from robofish_agents.evaluation.suites import TRUST
from robofish_agents.sweep.plan import Trial
from robofish_agents.training.config import TrainConfig
from robofish_agents.training.lock import Held
from robofish_agents.training.run import CONFIG, EVALUATIONS, POLICY, best_of, holds_config, train
from robofish_agents.training.schema import build

PLAN, TABLE, TUNE = "sweep.yaml", "sweep.csv", "tune"
FINISHED, UNFINISHED = "finished", "unfinished"
RETRIES = 3
"""How often a trial goes on from its checkpoint after its process or machine died."""
LOCK_PATIENCE_S = 60.0
"""A process that lost its machine may hold the folder for a moment longer."""
Tell = Callable[[str, dict[str, float]], object]


def run_sweep(
    trials: Sequence[Trial],
    out: Path,
    cluster: ClusterSettings,
    tell: Tell = lambda name, row: None,
) -> list[dict[str, Any]]:
    """Trains unfinished trials, and writes ``sweep.csv``, a row for each trial.

    A trial whose process or machine failed, or that was stopped, continues from its last checkpoint
    with the same bits as an uninterrupted one. On several machines all must see
    ``out`` under the same path.

    Args:
        trials: from :func:`robofish_agents.sweep.plan.plan`.
        out: folder of run folders.
        cluster: where to train.
        tell: receives the name of a trial and the row of each evaluation.

    Returns:
        The rows of the table.

    Raises:
        MissingExtraError: Ray is not installed.
        ConfigError: there is no cluster, or a folder holds another training of the same name.
        OutputError: a file cannot be written.
    """
    check_no_links([out / PLAN, out / TABLE])
    check_first_line(out / PLAN, f"# {WRITTEN_BY}")
    check_first_line(out / TABLE, "trial,")
    for trial in trials:
        _check_folder(trial, out / trial.name)
    left = [trial for trial in trials if _evaluations(trial, out)[0] != FINISHED]
    plan = {trial.name: dict(trial.changes) | {"seed": trial.config.seed} for trial in trials}
    text = yaml.safe_dump(plan, sort_keys=False, allow_unicode=True)
    write_text(out / PLAN, stamped(text))
    reasons: dict[str, str] = {}
    try:
        if left:
            with connected(cluster):
                reasons = _tune(left, out.resolve(), tell)
    finally:
        rows = [_row(trial, out, reasons.get(trial.name, "")) for trial in trials]
        _write_table(out / TABLE, rows)
    return rows


def _check_folder(trial: Trial, folder: Path) -> None:
    file = folder / CONFIG
    if file.is_file() and not holds_config(file, trial.config):
        raise ConfigError(
            f"{folder}: holds a training of another configuration; move it away, or give another "
            "folder with --out"
        )


def _evaluations(trial: Trial, out: Path) -> tuple[str, list[dict[str, float]]]:
    """Whether a trial is finished, and its evaluations so far."""
    file = out / trial.name / EVALUATIONS
    if not file.is_file():
        return UNFINISHED, []
    try:
        table = csv.DictReader(io.StringIO(read_text(file, MOST_TABLE_BYTES), newline=""))
        rows = [{key: float(value) for key, value in row.items()} for row in table]
        done = bool(rows) and rows[-1]["steps"] >= trial.config.total_steps
        if rows:
            best_of(rows)
    except (Unreadable, KeyError, TypeError, ValueError, csv.Error) as error:
        raise ConfigError(
            f"{file}: no evaluations of a training ({shown(str(error))}); move its folder away to "
            "train it again"
        ) from None
    return FINISHED if done else UNFINISHED, rows


def _row(trial: Trial, out: Path, reason: str) -> dict[str, Any]:
    state, evaluations = _evaluations(trial, out)
    best = best_of(evaluations) if evaluations else {}
    return {
        "trial": trial.name,
        **trial.changes,
        "seed": trial.config.seed,
        "state": state,
        **{f"best_{key}": value for key, value in best.items()},
        "policy": str(Path(trial.name) / POLICY) if best else "",
        "reason": reason if state == UNFINISHED else "",
    }


def _write_table(file: Path, rows: Sequence[dict[str, Any]]) -> None:
    names = list(dict.fromkeys(key for row in rows for key in row if key != "reason"))
    write_rows(file, [*names, "reason"], rows)


def _tune(trials: Sequence[Trial], out: Path, tell: Tell) -> dict[str, str]:
    """Trains with Ray Tune; name -> reason of the trials that failed."""
    os.environ.setdefault("TUNE_DISABLE_SIGINT_HANDLER", "1")  # Ctrl-C is ours
    from ray import tune
    from ray.tune import Callback, FailureConfig, RunConfig, Tuner

    class Teller(Callback):  # type: ignore[misc]
        """Passes evaluations on."""

        tell: Tell | None = None

        def __getstate__(self) -> dict[str, Any]:
            # Tune pickles its callbacks; a console cannot be.
            return {}

        def on_trial_result(self, iteration: int, trials: Any, trial: Any, result: Any) -> None:
            """Reports an evaluation."""
            if self.tell is not None:
                self.tell(trial.config["trial"]["name"], result)

    teller = Teller()
    teller.tell = tell

    specs = [
        {
            "name": trial.name,
            "folder": str(out / trial.name),
            "config": trial.config.tree() | {TRUST: trial.config.trust_effects},
            "version": VERSION,
        }
        for trial in trials
    ]
    tuner = Tuner(
        tune.with_resources(_trial, {"cpu": 1}),
        param_space={"trial": tune.grid_search(specs)},
        run_config=RunConfig(
            name=f"{datetime.now():%Y%m%d-%H%M%S}",
            storage_path=str(out / TUNE),
            failure_config=FailureConfig(max_failures=RETRIES),
            callbacks=[teller],
            verbose=0,
        ),
    )
    results = tuner.fit()
    failed = [result for result in results if result.error is not None]
    return {result.config["trial"]["name"]: _line(result.error) for result in failed}


def _line(error: BaseException) -> str:
    cause = getattr(error, "cause", None) or error
    return (str(cause).strip().splitlines() or [type(cause).__name__])[-1]


class _Reporter:
    """Passes evaluations to Ray Tune."""

    def stepped(self, steps: int) -> None:
        """Ignores steps."""

    def evaluated(self, row: dict[str, float]) -> None:
        """Reports an evaluation."""
        from ray import tune

        tune.report(dict(row))


def _trial(space: dict[str, Any]) -> None:
    """Runs one training in a worker, from its checkpoint if there is one."""
    spec = space["trial"]
    check_version(spec["version"])
    folder = Path(spec["folder"])
    if not (folder.parent / PLAN).is_file():
        raise ConfigError(
            f"{folder.parent}: not seen from {socket.gethostname()}; give --out on a disk that all "
            "machines share"
        )
    config = build(TrainConfig, spec["config"], spec["name"])
    until = time.monotonic() + LOCK_PATIENCE_S
    while True:
        try:
            train(config, folder, _Reporter(), resume=True)
            return
        except Held:
            if time.monotonic() > until:
                raise
            time.sleep(1.0)
