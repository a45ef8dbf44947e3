"""Where the commands write."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table

console = Console(stderr=True)
"""What happens, for a person."""
output = Console()
"""What was asked for, for a person or a program."""


def complain(message: str) -> None:
    """Say in one line why a command ends."""
    text = " ".join(message.split()).replace("[", "\\[")
    console.print(f"[red]plancurate:[/] {text}", soft_wrap=True, highlight=False)


def table(*columns: str) -> Table:
    """Make a plain table."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        shown.add_column(column, overflow="fold")
    return shown


def write(answer: str) -> None:
    """Write to standard output as it is, for programs: no wrapping, no colours."""
    sys.stdout.write(answer if answer.endswith("\n") else answer + "\n")
