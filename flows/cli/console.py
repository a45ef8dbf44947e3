"""Where the commands write."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

console = Console(stderr=True)
"""What happens, for a person."""
output = Console()
"""What was asked for, for a person or a program."""


def table(*columns: str) -> Table:
    """Make a plain table."""
    shown = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        shown.add_column(column, overflow="fold")
    return shown
