"""`robofish`, the command line. Thin: every command lives in :mod:`fish_env.commands`.

Only typer and rich are imported here; what a command needs is imported when it runs. Packages add
commands as entry points of the group ``robofish.commands``: functions that take the typer app.
"""

from __future__ import annotations

import atexit
import gc
import warnings
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from fish_env.commands.campaign import campaign
from fish_env.commands.ending import complain, leave_broken_pipe
from fish_env.commands.import_command import import_command
from fish_env.commands.options import (
    Commands,
    Json,
    MeasuredBeats,
    OtherFish,
    Patient,
    Quick,
    Seed,
    TrustEffects,
    Version,
)
from fish_env.errors import Interrupted, RoboticFishError

app = typer.Typer(
    name="robofish",
    cls=Commands,
    help="Simulate, compare and study a tail-driven robotic fish.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)


@app.callback()
def robofish(version: Version = False) -> None:
    """Simulate, compare and study a tail-driven robotic fish."""


@app.command()
def simulate(
    case: Annotated[
        Path,
        typer.Argument(help="The case, a JSON file; - is standard input.", metavar="CASE.json"),
    ],
    dt: Annotated[float, typer.Option(help="Longest physics step, s.")] = 0.001,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 10.0,
    out: Annotated[
        Path | None,
        typer.Option(help="A .csv or .parquet file. Without it, or with -, CSV is printed."),
    ] = None,
    replay: Annotated[Path | None, typer.Option(help="HTML replay page to write.")] = None,
    json: Json = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Simulate one case and write pose and velocities over time.

    A case names the fish, the duration and the schedule of commands. It may also give the
    initial state and effects.

    **Example:** `robofish simulate case.json --rate 50 --out swim.csv`
    """
    from fish_env.commands.simulate import simulate_case

    simulate_case(case, dt, rate, out, replay, trust_effects, json)


@app.command()
def compare(
    dataset: Annotated[
        str, typer.Argument(help="A folder with dataset.yaml, or a shipped dataset's name.")
    ],
    fish: OtherFish = None,
    json: Json = None,
    out: Annotated[Path | None, typer.Option(help="Folder for pictures.")] = None,
    dt: Annotated[float, typer.Option(help="Longest physics step, s.")] = 0.01,
    runs: Annotated[bool, typer.Option("--runs", help="Print every run.")] = False,
    replay: Annotated[
        Path | None, typer.Option(help="HTML replay page of measured and simulated runs.")
    ] = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Compare measured motion with its simulation: how wrong it is, and where.

    Runs over time are simulated from their measured start. If the tail phase at the start is
    unknown, the best of sixteen phases over the first beat is used.

    **Example:** `robofish compare msu-steady --out pictures --json errors.json`
    """
    from fish_env.commands.compare import compare_dataset
    from fish_env.commands.numbers import console_for

    compare_dataset(console_for(json), dataset, fish, json, out, dt, runs, replay, trust_effects)


app.command("import")(import_command)


@app.command()
def replay(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Trajectories (.csv, .parquet, or - for CSV from standard input) or runs.",
            metavar="FILE",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The page to write; - is standard output.", show_default="replay.html"),
    ] = None,
    fish: Annotated[
        str | None, typer.Option(help="Fish whose size is drawn: preset or file.")
    ] = None,
    case: Annotated[
        Path | None, typer.Option(help="Case of the simulation; its commands move the tail.")
    ] = None,
) -> None:
    """Write a page with fish in 3-D beside time plots; it opens without a network.

    Several files are shown at once. A file whose name ends in measured, baseline or extended
    gets the colour of that kind.

    **Example:** `robofish replay swim.csv --case case.json --out swim.html`
    """
    from fish_env.commands.numbers import console_for
    from fish_env.commands.replay import replay_files
    from fish_env.files import named_or_chosen

    page = named_or_chosen(out, "replay.html")
    replay_files(console_for(page), files, page, fish, case)


@app.command()
def diagnose(
    dataset: Annotated[
        str, typer.Argument(help="A folder with dataset.yaml, or a shipped dataset's name.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("out/diagnosis"),
    fish: OtherFish = None,
    quick: Quick = False,
    measured_beats: MeasuredBeats = False,
    seed: Seed = 0,
    json: Json = None,
    trust_effects: TrustEffects = False,
    patient: Patient = False,
) -> None:
    """Find what the simulation lacks: a cause with its size, or that no known cause fits.

    Refits the coefficients, tries every effect of the catalogue, and measures the gain of the
    best one on held-out runs. Writes `diagnosis.json`, `report.html`, and the fish file
    `extended.yaml` if there is an extended model. Other files in the folder are kept.

    **Example:** `robofish diagnose pool-trials --out out/pool`
    """
    from fish_env.commands.diagnose import diagnose_dataset
    from fish_env.commands.numbers import console_for

    diagnose_dataset(
        console_for(json), dataset, out, fish, quick, seed, measured_beats, trust_effects, json,
        patient,
    )  # fmt: skip


@app.command()
def fit(
    dataset: Annotated[
        str, typer.Argument(help="A folder with dataset.yaml, or a shipped dataset's name.")
    ],
    fish: OtherFish = None,
    effects: Annotated[
        str,
        typer.Option(
            help="Effects to fit beside the coefficients, separated by commas; or auto, for "
            "those that lower the held-out error."
        ),
    ] = "",
    objective: Annotated[
        str | None,
        typer.Option(
            help="Prediction errors to minimise: one-step, whole-run or means.",
            show_default="one-step; means of a steady table",
        ),
    ] = None,
    leave_out: Annotated[
        str | None,
        typer.Option(
            help="condition, run, or a command: leave out each of its values in turn, and report "
            "the errors on the data left out."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The parameter file to write.", show_default="identified.yaml"),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option("--json", "--results", help="File for all numbers; - is standard output."),
    ] = None,
    trust_inputs: Annotated[
        bool,
        typer.Option(
            "--trust-inputs",
            help="Use signs, units and clocks as declared, even if the input check finds faults.",
        ),
    ] = False,
    trust_effects: TrustEffects = False,
) -> None:
    """Fit a fish's coefficients to measured data and write them with their uncertainty.

    **Example:** `robofish fit trials --objective whole-run --effects servo_lag --leave-out run`
    """
    from fish_env.commands.fit import effects_from, fit_and_write
    from fish_env.commands.numbers import console_for
    from fish_env.files import named_or_chosen

    fit_and_write(
        console_for(results), dataset, fish, effects_from(effects),
        named_or_chosen(out, "identified.yaml"), trust_effects, objective, leave_out, results,
        trust_inputs,
    )  # fmt: skip


@app.command()
def info(
    fish: Annotated[str, typer.Option(help="A preset's name, or a parameter file.")] = (
        "zheng-2021-a"
    ),
    json: Json = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Show a fish: parameters and where they come from, trim, stability, reach and speeds.

    **Example:** `robofish info --fish msu-tail-fish`
    """
    from fish_env.commands.info import print_info
    from fish_env.commands.numbers import console_for

    print_info(console_for(json), fish, trust_effects, json)


@app.command()
def plot(
    kind: Annotated[
        str, typer.Argument(help="motions, polar, forces, trim, or all.", metavar="KIND")
    ],
    fish: Annotated[str, typer.Option(help="A preset's name, or a parameter file.")] = (
        "zheng-2021-a"
    ),
    out: Annotated[Path, typer.Option(help="Folder for pictures.")] = Path("out/plots"),
    format: Annotated[
        list[str] | None,
        typer.Option(help="png, svg or pdf; may be given more than once.", show_default="png"),
    ] = None,
    trust_effects: TrustEffects = False,
) -> None:
    """Draw a fish for a paper: the four motions, polar diagrams, forces over a beat, trim curves.

    **Example:** `robofish plot forces --fish zheng-2021-b --format pdf --format png`
    """
    from fish_env.commands.plot import plot_fish

    plot_fish(Console(), kind, fish, out, format or ["png"], trust_effects)


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help="Folder for tables and pictures.")] = Path("out/paper"),
    json: Json = None,
) -> None:
    """Repeat the four studies of the paper and check each of its statements.

    Writes the paper's figures, `statements.md` and `paper.json`.

    **Example:** `robofish paper --out out/paper`
    """
    from fish_env.commands.numbers import console_for
    from fish_env.commands.paper import run_paper

    run_paper(console_for(json), out, json)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("out/demo"),
    json: Json = None,
) -> None:
    """Show what the package does, in a minute or two: diagnosis, comparison and environment.

    **Example:** `robofish demo`
    """
    from fish_env.commands.demo import run_demo
    from fish_env.commands.numbers import console_for

    run_demo(console_for(json), out, json)


@app.command()
def effects(json: Json = None) -> None:
    """List the effects that can be added to the model, with their parameters.

    **Example:** `robofish effects`
    """
    from fish_env.commands.effects import print_effects
    from fish_env.commands.numbers import console_for

    print_effects(console_for(json), json)


app.command()(campaign)

GROUP = "robofish.commands"
INTERRUPTED = 130
"""Exit status of a command that a person stopped, as of shells."""


def add_commands(to: typer.Typer) -> None:
    """Adds the commands of installed packages; one that cannot be loaded is left out, and said."""
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        try:
            register = entry.load()
        except (ImportError, AttributeError) as error:
            warnings.warn(f"command '{entry.name}' is left out: {error}", stacklevel=2)
        else:
            register(to)


add_commands(app)


def main() -> None:
    """Runs `robofish`. Our errors are one red line and exit status 2; Ctrl-C is yellow and 130."""
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_: complain("yellow", f"robofish: {message}")
        # On its way out the interpreter would look for garbage among all that the compiler made,
        # which takes most of a second; it goes with the process.
        atexit.register(gc.freeze)
        _run()


def _run() -> None:
    try:
        app(prog_name="robofish")
    except Interrupted as error:
        complain("yellow", f"robofish: {error}")
        raise SystemExit(INTERRUPTED) from None
    except RoboticFishError as error:
        if isinstance(error.__cause__, BrokenPipeError):
            leave_broken_pipe()
        complain("red", f"robofish: {error}")
        raise SystemExit(2) from None
    except BrokenPipeError:
        leave_broken_pipe()
    except OSError as error:
        named = f"{error.filename}: " if error.filename else ""
        complain("red", f"robofish: {named}{error.strerror or error}")
        raise SystemExit(2) from None


if __name__ == "__main__":
    main()
