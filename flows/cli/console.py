"""Where the commands write."""

from __future__ import annotations

from rich.console import Console

console = Console(stderr=True)
"""What happens, for a person."""
output = Console()
"""What was asked for, for a person or a program."""
