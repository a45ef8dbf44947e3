"""What a person sees while a stage runs: one bar a stage, counts of what went well and what did not."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from time import perf_counter

from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from plancurate.flows.cli.console import console
from plancurate.flows.run_page import PageProgress, tell


class Bar:
    """Counts of one stage, shown on the terminal and in Prefect; safe to advance from several threads."""

    def __init__(self, progress: Progress, title: str, total: int, unit: str) -> None:
        self._progress, self._lock, self._total, self._unit = progress, Lock(), total, unit
        self._task = progress.add_task(title, total=total, note="")
        self._page = PageProgress(title, 0.0 if total else 1.0)
        self.done = self.failed = 0.0

    def advance(self, done: float = 1, failed: int = 0) -> None:
        """Add finished items, `failed` of them without success."""
        with self._lock:
            self.done, self.failed = self.done + done, self.failed + failed
            self._progress.update(self._task, completed=self.done, note=self.note())
            self._page.show(self.done / self._total)

    def note(self) -> str:
        """Counts in words."""
        counts = f"{round(self.done - self.failed)}/{self._total} {self._unit}"
        return f"{counts}, [yellow]{round(self.failed)} failed[/]" if self.failed else counts


@contextmanager
def stage(title: str, total: int, unit: str) -> Iterator[Bar]:
    """Show one bar for a stage while it runs, and one line when it is over."""
    progress = Progress(
        SpinnerColumn(),
        TextColumn("{task.description:<9}"),
        BarColumn(bar_width=32),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    start = perf_counter()
    with progress:
        bar = Bar(progress, title, total, unit)
        yield bar
    seconds = f"[dim]{perf_counter() - start:.1f} s[/]"
    tell(f"[green]✓[/] {title:<9} {bar.note()}  {seconds}")
