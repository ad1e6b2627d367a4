"""Tables of a log and a mapping made into runs on one clock, in the units of the log.

What comes out is what `dataset.yaml` and the CSV files beside it hold, so that the reader of
datasets does all conversion and checking.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fish_env.arrays import FloatArray
from fish_env.data.declared import TIME
from fish_env.data.description import FILE_NAME, parse_description
from fish_env.data.importing.grouping import RunInput, group_runs
from fish_env.data.importing.plan import Content, Entry, Plan, plan_text
from fish_env.data.importing.source import Source
from fish_env.data.importing.stamps import EPOCH_NS, Nanoseconds, Stamps, read_stamps
from fish_env.data.mapping import parse_section
from fish_env.data.place import Place
from fish_env.data.reading import build_dataset
from fish_env.data.run_file import build_run
from fish_env.data.schema import Dataset
from fish_env.data.table import Table
from fish_env.data.vocabulary import COMMANDS, FORMAT
from fish_env.errors import DatasetError

Columns = dict[str, FloatArray]

_KEPT = ("sign", "scale", "offset", "unit", "frame")
_LATE = 1.5
"""Usual sample intervals by which a first command may come after the first sample unmentioned."""


@dataclass(frozen=True)
class Imported:
    """Logs made into a dataset.

    Attributes:
        description: Content of its dataset.yaml.
        tables: Columns of each run by id: `t`, channels and commands, in the log's units.
        dataset: The same in SI units and the model's frame.
        notes: What was sorted, filled or left out.
    """

    description: Content
    tables: Mapping[str, Columns]
    dataset: Dataset
    notes: tuple[str, ...]


def assemble(plan: Plan, sources: Sequence[Source], folder: Path) -> Imported:
    """Makes a dataset of the tables of some logs, in memory.

    Args:
        plan: The mapping.
        sources: All tables of the logs.
        folder: Where the dataset may be written later; errors name its files.

    Raises:
        DatasetError: Tables, columns or times do not fit together, or the values cannot be what
            the mapping says.
    """
    return assemble_runs(plan, group_runs(plan, sources), folder)


def assemble_runs(plan: Plan, inputs: Sequence[RunInput], folder: Path) -> Imported:
    """Makes a dataset of runs whose tables are known; see :func:`assemble`."""
    notes = list[str]()
    tables: dict[str, Columns] = {}
    for run in inputs:
        if run.id in tables:
            raise DatasetError(f"two runs have the name '{run.id}'. Give them names under `runs`.")
        tables[run.id], run_notes = _run_columns(plan, run)
        notes += run_notes
    description = _description(plan, inputs)
    return Imported(description, tables, _dataset(description, tables, folder), tuple(notes))


def _dataset(description: Content, tables: Mapping[str, Columns], folder: Path) -> Dataset:
    place = Place(folder / FILE_NAME)
    checked = parse_description(parse_section(plan_text(description), place))
    read = []
    for entry in checked.runs:
        columns = tables[entry.id]
        # The rows as they are in the file that may be written: the header is row 1.
        rows = list(range(2, len(columns[TIME]) + 2))
        table = Table(Place(folder / entry.file.name, run=entry.id), rows, columns)
        read.append(build_run(checked, entry, table))
    return build_dataset(checked, read)


def _description(plan: Plan, runs: Sequence[RunInput]) -> Content:
    content = plan.content
    files = dict.fromkeys(source.file.name for run in runs for source in run.sources.values())
    noise = {"noise": content["noise"]} if "noise" in content else {}
    return {
        "format": FORMAT,
        "name": content["name"],
        "fish": content["fish"],
        "frame": content["frame"],
        "source": ", ".join(files),
        "comment": "imported by robofish import",
        "time": {"column": TIME, "unit": "s"},
        "channels": {name: _declared(content["channels"][name]) for name in plan.channels},
        "commands": {name: _declared(content["commands"][name]) for name in plan.commands},
        "constant_commands": content.get("constant_commands", {}),
        **noise,
        "runs": [
            {
                "id": run.id,
                "file": f"{run.id}.csv",
                "start": content.get("start", "unknown"),
                "tail_phase": content.get("tail_phase", "unknown"),
                **run.about,
            }
            for run in runs
        ],
    }


def _declared(entry: Content) -> Content | str:
    """A channel as dataset.yaml declares it, by its unit alone where that says all."""
    kept = {key: entry[key] for key in _KEPT if key in entry}
    return str(kept["unit"]) if list(kept) == ["unit"] else kept


def _run_columns(plan: Plan, run: RunInput) -> tuple[Columns, list[str]]:
    stamps = {
        name: read_stamps(source, plan.sources[name].time) for name, source in run.sources.items()
    }
    _check_clocks(run, stamps)
    notes = [f"run {run.id}: {note}" for each in stamps.values() for note in each.notes]
    channels = {n: _samples(e, run.sources[e.source], stamps) for n, e in plan.channels.items()}
    commands = {n: _samples(e, run.sources[e.source], stamps) for n, e in plan.commands.items()}
    for name, (_, values) in {**channels, **commands}.items():
        if not values.size:
            entry = plan.channels.get(name) or plan.commands[name]
            place = run.sources[entry.source].place(entry.column.name)
            raise place.refuse(f"run {run.id} has no value of {name}", "Map another column")
    sampled = np.unique(np.concatenate([times for times, _ in channels.values()]))
    grid = _with_switches(
        sampled, [_switches(*commands[n]) for n, e in plan.commands.items() if e.between == "hold"]
    )
    columns: Columns = {TIME: (grid - grid[0]) / 1e9}
    for name, (times, values) in channels.items():
        columns[name] = np.full(grid.shape, np.nan)
        columns[name][np.searchsorted(grid, times)] = values + 0.0  # turns -0 into 0
    for name, entry in plan.commands.items():
        columns[name], note = _at(grid, sampled, *commands[name], entry, f"run {run.id}: {name}")
        notes += [note] if note else []
    # The order of the file: time, channels, commands as the simulator knows them.
    order = [name for name in COMMANDS if name in commands]
    return {
        **{n: a for n, a in columns.items() if n not in commands},
        **{n: columns[n] for n in order},
    }, notes


def _check_clocks(run: RunInput, stamps: Mapping[str, Stamps]) -> None:
    """Refuses sources of which one counts from a date and another does not, or that never meet."""
    spans = {
        name: (int(each.ns[0]), int(each.ns[-1])) for name, each in stamps.items() if each.ns.size
    }
    dated = {name for name, span in spans.items() if span[0] >= EPOCH_NS}
    if dated and len(dated) < len(spans):
        other = sorted(spans.keys() - dated)
        raise DatasetError(
            f"run {run.id}: the clock of {', '.join(sorted(dated))} counts from a date and that "
            f"of {', '.join(other)} does not. Map a time column that both share, or give "
            f"`time: {{..., offset: SECONDS}}` to {other[0]}."
        )
    begin, end = max(s[0] for s in spans.values()), min(s[1] for s in spans.values())
    if begin > end:
        words = ", ".join(
            f"{n} {(s[0] - begin) / 1e9:.4g} to {(s[1] - begin) / 1e9:.4g} s"
            for n, s in spans.items()
        )
        raise DatasetError(
            f"run {run.id}: the clocks of its sources never meet ({words}). Give one of them "
            "`time: {..., offset: SECONDS}`."
        )


def _samples(
    entry: Entry, source: Source, stamps: Mapping[str, Stamps]
) -> tuple[Nanoseconds, FloatArray]:
    """Times, ns, and values where there are any."""
    mine = stamps[entry.source]
    values = source.numbers(entry.column.name)[mine.rows]
    present = ~np.isnan(values)
    return mine.ns[present], values[present]


def _switches(times: Nanoseconds, values: FloatArray) -> Nanoseconds:
    switched: Nanoseconds = times[1:][values[1:] != values[:-1]]
    return switched


def _with_switches(sampled: Nanoseconds, switches: Sequence[Nanoseconds]) -> Nanoseconds:
    """Sample times, and between them the times at which a command changes."""
    every = np.concatenate([np.zeros(0, np.int64), *switches])
    inside = every[(every > sampled[0]) & (every < sampled[-1])]
    return np.union1d(sampled, inside)


def _at(
    grid: Nanoseconds,
    sampled: Nanoseconds,
    times: Nanoseconds,
    values: FloatArray,
    entry: Entry,
    name: str,
) -> tuple[FloatArray, str]:
    """A command at every row, and a note if its first value is held backwards."""
    if entry.between == "linear":
        at = np.interp((grid - grid[0]) / 1e9, (times - grid[0]) / 1e9, values)
    else:
        at = values[np.maximum(np.searchsorted(times, grid, side="right") - 1, 0)]
    at = at + 0.0  # turns -0 into 0
    late = float(times[0] - grid[0]) / 1e9
    step = float(np.median(np.diff(sampled))) / 1e9 if sampled.size > 1 else 0.0
    if late > _LATE * step:
        return at, (
            f"{name} is first commanded {late:.3g} s after the first sample and taken to have "
            "held before"
        )
    return at, ""
