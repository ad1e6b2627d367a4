"""A campaign: what is finished is read back, the rest is diagnosed, every result is kept whole."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from fish_env.campaign.cases import Case, Diagnosed, Options, Payload, diagnosed, prepare
from fish_env.cluster import ClusterSettings, Failed, Task, connected, run_tasks
from fish_env.errors import OutputError, RoboticFishError
from fish_env.files import (
    check_first_line,
    check_no_links,
    write_bytes,
    write_rows,
    write_text,
)
from fish_env.reading import Unreadable, is_number, printable, read_json, shown
from fish_env.version import VERSION

MARK = "case.json"
"""Written last into the folder of a case: it is finished."""
TABLE = "campaign.csv"
FINISHED, FAILED = "finished", "failed"


@dataclass(frozen=True)
class Row:
    """What became of one data set.

    Attributes:
        name: of the folder of the case.
        source: the data set.
        state: ``finished`` or ``failed``.
        verdict: of the diagnosis; empty where it failed.
        causes: names of the causes, a space between.
        runtime_s: seconds of the diagnosis.
        reason: why it failed.
    """

    name: str
    source: str
    state: str
    verdict: str = ""
    causes: str = ""
    runtime_s: float = 0.0
    reason: str = ""


def run_campaign(
    cases: Sequence[Case],
    out: Path,
    options: Options,
    cluster: ClusterSettings,
    tell: Callable[[Row], object] = lambda row: None,
) -> list[Row]:
    """Diagnoses data sets on a cluster, each into a folder below ``out``.

    A case that is finished there is read back and never done again. Only this process writes into
    the folder, so the other machines need not see it. Stopped at any moment and started again, it
    gives the same files as one that was not, but for the times that diagnoses took.

    Args:
        cases: from :func:`find_cases`.
        out: folder of results.
        options: how each is diagnosed.
        cluster: where.
        tell: told each row as it comes.

    Returns:
        The rows, in the order of the cases; they also stand in ``campaign.csv``.

    Raises:
        MissingExtraError: Ray is not installed.
        ConfigError: there is no cluster.
        OutputError: a result cannot be written.
    """
    check_no_links([out / TABLE])
    check_first_line(out / TABLE, ",".join(field.name for field in fields(Row)))
    rows: dict[str, Row] = {}

    def done(row: Row) -> None:
        rows[row.name] = row
        tell(row)

    ordered: list[Row] = []
    try:
        tasks = _to_do(cases, out, options, done)
        first = next(tasks, None)
        if first is not None:
            with connected(cluster) as ray:
                for task, result in run_tasks(ray, diagnosed, _before(first, tasks)):
                    done(_kept(task, result, out))
    finally:
        ordered = [rows[case.name] for case in cases if case.name in rows]
        if ordered:
            _write_table(out / TABLE, ordered)
    return ordered


@dataclass(frozen=True)
class _Known(Task[Payload]):
    case: Case


def _before(first: Task[Payload], rest: Iterator[Task[Payload]]) -> Iterator[Task[Payload]]:
    yield first
    yield from rest


def _to_do(
    cases: Sequence[Case], out: Path, options: Options, done: Callable[[Row], None]
) -> Iterator[Task[Payload]]:
    """Tasks of the cases that are not finished; the others become rows at once."""
    for case in cases:
        try:
            payload = prepare(case, options, out / case.name, out / TABLE)
            finished = _read_mark(case, out, payload.digest)
        except OutputError:
            raise
        except RoboticFishError as error:
            done(Row(case.name, case.source, FAILED, reason=" ".join(str(error).split())))
            continue
        if finished is None:
            yield _Known(case.name, payload, case)
        else:
            done(finished)


def _read_mark(case: Case, out: Path, digest: str) -> Row | None:
    """The row of a finished case; None where there is none.

    Raises:
        OutputError: the folder holds a result of other data or options.
    """
    file = out / case.name / MARK
    try:
        mark = read_json(file)
        row = {field.name: _as(field.type, mark["row"][field.name]) for field in fields(Row)}
        saved = mark["digest"]
    except FileNotFoundError:
        return None
    except (Unreadable, KeyError, TypeError) as error:
        raise OutputError(
            f"{file}: no mark of a finished case ({error}); move its folder away"
        ) from None
    if saved != digest:
        raise OutputError(
            f"{file.parent}: was diagnosed from other data, another fish or with other options; "
            "move it away, or give another folder with --out"
        )
    return Row(**{**row, "source": case.source})


def _as(kind: Any, value: Any) -> Any:
    """A value of a mark that is of the type of its field, a text or a number."""
    if kind == "float" and is_number(value):
        return float(value)
    if kind == "str" and isinstance(value, str):
        return printable(value)
    raise TypeError(f"{shown(value)} in it")


def _kept(task: Task[Payload], result: Diagnosed | Failed, out: Path) -> Row:
    """Writes what came back, the mark last."""
    assert isinstance(task, _Known)
    case = task.case
    if isinstance(result, Failed):
        return Row(case.name, case.source, FAILED, reason=result.reason)
    answer, folder = result.answer, out / case.name
    causes = " ".join(cause["name"] for cause in answer["causes"])
    row = Row(case.name, case.source, FINISHED, answer["verdict"], causes, answer["runtime_s"])
    check_no_links([folder / name for name in result.files])
    for name, content in result.files.items():
        write_bytes(folder / name, content)
    mark: dict[str, Any] = {"version": VERSION, "digest": task.payload.digest, "row": asdict(row)}
    write_text(folder / MARK, json.dumps(mark, indent=1) + "\n")
    return row


def _write_table(file: Path, rows: Sequence[Row]) -> None:
    write_rows(file, [field.name for field in fields(Row)], [asdict(row) for row in rows])
