"""How `robofish` ends where something went wrong."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from rich.console import Console
from rich.markup import escape


def complain(colour: str, text: str) -> None:
    """Prints a message for people to the standard error, in one colour."""
    from fish_env.reading import printable

    Console(stderr=True, soft_wrap=True).print(escape(printable(text)), style=colour)


def leave_broken_pipe() -> NoReturn:
    """Ends quietly, as other programs do whose reader, such as `head`, has seen enough."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise SystemExit(1)
