"""Results for notebooks: a short text, a table, pictures, files."""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Iterable
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import TextWrapper
from typing import TYPE_CHECKING, Any

from fish_env.comparison import RunsComparison, SteadyComparison
from fish_env.comparison.words import in_words
from fish_env.diagnosis.headline import headline
from fish_env.diagnosis.writing import EXTENDED, check_marks
from fish_env.files import check_chosen, check_no_links, write_bytes
from fish_env.identification.dataset_fit import DatasetFit
from fish_env.params import FishParams, load_fish
from fish_env.params.io import check_tables_of
from fish_env.version import versioned

if TYPE_CHECKING:
    import pandas as pd

REPORT = "report.html"
MOST_SENTENCES = 4
_WRAPPER = TextWrapper(80, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False)
"""Cells of notebooks do not wrap lines of text."""


class Pictures:
    """Pictures that a notebook shows.

    Attributes:
        paths: Their files.
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self.paths = tuple(paths)
        self._shown = [_embedded(path) for path in self.paths]

    def __repr__(self) -> str:
        return f"Pictures({', '.join(path.name for path in self.paths)})"

    def _repr_html_(self) -> str:
        return "".join(self._shown)


def _embedded(path: Path) -> str:
    kind = {".svg": "svg+xml"}.get(path.suffix, path.suffix[1:])
    code = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{escape(path.stem)}" src="data:image/{kind};base64,{code}">'


class Result:
    """What the results have in common."""

    def title(self) -> str:
        """One line for a heading."""
        raise NotImplementedError

    def sentences(self) -> list[str]:
        """What was found, in words."""
        raise NotImplementedError

    def to_dataframe(self) -> pd.DataFrame:
        """The numbers as a table."""
        raise NotImplementedError

    def __repr__(self) -> str:
        """The title and the first findings."""
        found = self.sentences()[:MOST_SENTENCES]
        return "\n".join([self.title(), *(_WRAPPER.fill(sentence) for sentence in found)])

    def _repr_html_(self) -> str:
        """The title, the findings and the table."""
        listed = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.sentences())
        table = self.to_dataframe().to_html(index=False, max_rows=20, float_format="{:.4g}".format)
        return f"<p><b>{escape(self.title())}</b></p><ul>{listed}</ul>{table}"


class CompareResult(Result):
    """How wrong a simulation is.

    Attributes:
        comparison: Every number, see :mod:`fish_env.comparison`.
    """

    def __init__(self, comparison: RunsComparison | SteadyComparison) -> None:
        self.comparison = comparison

    def title(self) -> str:
        """Data and fish."""
        return f"{self.comparison.dataset} against {self.comparison.fish}"

    def sentences(self) -> list[str]:
        """Where and how much the simulation is wrong."""
        return in_words(self.comparison)

    def to_dataframe(self) -> pd.DataFrame:
        """Errors by run and channel, or by observation of a steady table; SI."""
        import pandas as pd

        if isinstance(self.comparison, SteadyComparison):
            scalars = ("rows", "r_squared", "mae", "bias", "gain", "percent_error", "repeat_sd")
            return pd.DataFrame(
                {"observation": name} | {key: getattr(o, key) for key in scalars}
                for name, o in self.comparison.observations.items()
            )
        return pd.DataFrame(
            {"run": run.id, "condition": run.condition, "channel": name} | dataclasses.asdict(error)
            for run in self.comparison.runs
            for name, error in run.errors.items()
        )

    def plot(self, folder: str | Path | None = None) -> Pictures:
        """Draws measured against simulated.

        Args:
            folder: Where the pictures stay; without it they are only shown.

        Raises:
            OutputError: A picture cannot be written, or would replace a file of someone else.
        """
        from fish_env.plotting.comparison import draw_runs, draw_steady, picture_files

        with TemporaryDirectory(prefix="robofish-") as passing:
            target = Path(folder or passing)
            check_chosen(picture_files(self.comparison, target))
            if isinstance(self.comparison, SteadyComparison):
                return Pictures(draw_steady(self.comparison, target))
            return Pictures(draw_runs(self.comparison, target))

    def save(self, file: str | Path) -> Path:
        """Writes all numbers as JSON, as `robofish compare --json` does.

        Args:
            file: The file.

        Raises:
            OutputError: It cannot be written.
        """
        return _write_json(file, self.comparison.as_dict())


class FitResult(Result):
    """A fitted fish.

    Attributes:
        result: Every number, see :mod:`fish_env.identification.dataset_fit`.
    """

    def __init__(self, result: DatasetFit) -> None:
        self.result = result

    @property
    def fish(self) -> FishParams:
        """The fitted fish, with its posterior."""
        return self.result.fish

    def title(self) -> str:
        """Data, fish and what was minimised."""
        found = self.result
        return f"{found.fish.name} fitted to {found.dataset} ({found.objective} errors)"

    def sentences(self) -> list[str]:
        """Errors, and what moved furthest from its prior."""
        found = self.result
        errors = ", ".join(
            f"{name} {value:.3g} {found.units[name]}" for name, value in found.mean_errors.items()
        )
        moved = [e for e in found.estimates if e.prior_sds_off is not None]
        moved.sort(key=lambda e: -abs(e.prior_sds_off or 0.0))
        furthest = [f"{e.name} moved by {e.prior_sds_off:+.1f} prior sd" for e in moved[:2]]
        return [f"{len(found.estimates)} parameters; mean absolute errors: {errors}", *furthest]

    def to_dataframe(self) -> pd.DataFrame:
        """Every estimate with its unit, value before, 95 % interval and move; SI."""
        import pandas as pd

        return pd.DataFrame(dataclasses.asdict(e) for e in self.result.estimates)

    def plot(self, folder: str | Path | None = None) -> Pictures:
        """Draws every estimate and its 95 % interval relative to the value before.

        Args:
            folder: Where the picture stays; without it it is only shown.

        Raises:
            OutputError: The picture cannot be written, or would replace a file of someone else.
        """
        from fish_env.plotting.estimates import draw_estimates, picture_files

        rows = [(e.name, e.before, e.value, e.low, e.high) for e in self.result.estimates]
        with TemporaryDirectory(prefix="robofish-") as passing:
            target = Path(folder or passing)
            check_chosen(picture_files(target))
            return Pictures([draw_estimates(rows, self.title(), target)])

    def save(self, file: str | Path, results: str | Path | None = None) -> Path:
        """Writes the fitted fish, as `robofish fit --out` does.

        Args:
            file: The parameter file.
            results: JSON file for estimates and errors; None for none.

        Raises:
            OutputError: A file cannot be written.
        """
        self.result.write(file, results)
        return Path(file)


class DiagnoseResult(Result):
    """What a simulation gets wrong.

    Attributes:
        answer: The content of `diagnosis.json`.
        folder: Where the report is; see `save`.
    """

    def __init__(
        self, answer: dict[str, Any], folder: Path, kept: TemporaryDirectory[str] | None = None
    ) -> None:
        self.answer = answer
        self.folder = folder
        self._kept = kept  # removed with this object

    @property
    def verdict(self) -> str:
        """The verdict in one word, such as `cause` or `no_misfit`."""
        return str(self.answer["verdict"])

    @property
    def fish(self) -> FishParams | None:
        """The extended fish, where there is something to extend."""
        file = self.folder / EXTENDED
        return load_fish(file) if file.is_file() else None

    def title(self) -> str:
        """The verdict."""
        causes = ", ".join(cause["name"] for cause in self.answer["causes"])
        return f"{self.verdict}: {causes}" if causes else self.verdict

    def sentences(self) -> list[str]:
        """Verdict, closed share of the gap, next step and caveats, as in the report."""
        return list(headline(self.answer).lines)

    def to_dataframe(self) -> pd.DataFrame:
        """Every parameter of the causes and of their rivals, with its 95 % interval."""
        import pandas as pd

        rows = [
            {
                "explanation": number,
                "cause": cause["name"],
                "parameter": name,
                "estimate": p["estimate"],
                "low": p["ci95"][0],
                "high": p["ci95"][1],
                "unit": p["unit"],
            }
            for number, causes in enumerate([self.answer["causes"], *self.answer["alternatives"]])
            for cause in causes
            for name, p in cause["parameters"].items()
        ]
        columns = ["explanation", "cause", "parameter", "estimate", "low", "high", "unit"]
        return pd.DataFrame(rows, columns=columns)

    def plot(self, folder: str | Path | None = None) -> Pictures:
        """Shows the figures of the report.

        Args:
            folder: Where copies of them go; None for none.
        """
        figures = sorted((self.folder / "figures").glob("*.svg"))
        if folder is not None:
            check_marks(Path(folder) / figure.name for figure in figures)
            for figure in figures:
                write_bytes(Path(folder) / figure.name, figure.read_bytes())
        return Pictures(figures)

    def save(self, folder: str | Path) -> Path:
        """Writes report, numbers and extended fish, as `robofish diagnose --out` does.

        Args:
            folder: Where to; other files in it stay.

        Returns:
            The report.

        Raises:
            OutputError: A file cannot be written, or is none of a diagnosis.
        """
        files = sorted(path for path in self.folder.rglob("*") if path.is_file())
        copies = {file: Path(folder) / file.relative_to(self.folder) for file in files}
        check_no_links(copies.values())
        check_marks(copies.values())
        own = Path(folder) / EXTENDED
        tables = (own.with_name(file.name) for file in self.folder.glob(f"{own.stem}.*.csv"))
        check_tables_of(own, tables)
        for file, copy in copies.items():
            write_bytes(copy, file.read_bytes())
        return Path(folder) / REPORT


def _write_json(file: str | Path, content: dict[str, Any]) -> Path:
    import json

    write_bytes(file, (json.dumps(versioned(content), indent=1, allow_nan=False) + "\n").encode())
    return Path(file)
