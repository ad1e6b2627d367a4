"""The command `robofish`, called as a user would, without a new process."""

import sys

import pytest

from fish_env.cli import main


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Exit status, standard output and standard error of `robofish`."""
    before, sys.argv = sys.argv, ["robofish", *arguments]
    capsys.readouterr()
    try:
        main()
        status = 0
    except SystemExit as end:
        status = int(end.code or 0)
    finally:
        sys.argv = before
    shown = capsys.readouterr()
    return status, shown.out, shown.err
