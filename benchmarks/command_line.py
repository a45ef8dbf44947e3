"""Processor time of the command line: what an answer costs beside the libraries that it is made with.

    python benchmarks/command_line.py [--runs 5]

Runs every command's `--help` and the shortest query on an empty lake, each in processes of its own, and sets the
median of user and system time of the whole process against a Python that imports DuckDB and Arrow and ends. A
command may take 0.8 s: it imports what it shows, and no learning or planning library.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

from claims import state

from plancurate.flows.cli.app import COMMANDS
from plancurate.tasks.lake.store import Lake

LIMIT_S = 0.8
PEER = ("-c", "import duckdb, pyarrow")


def main() -> None:
    """Print seconds of each command and how many times the peer's they are."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    peer_s = median_s(PEER, runs)
    print(f"processor time of a process, median of {runs}; {LIMIT_S} s would be the most")
    print(f"  {'python -c ' + repr(PEER[1]):40s} {peer_s:5.2f} s")
    slowest = 0.0
    with tempfile.TemporaryDirectory() as home:
        for words in (*helps(), query(Path(home))):
            seconds = median_s(("-m", "plancurate.flows.cli.app", *words), runs)
            slowest = max(slowest, seconds)
            late = "" if seconds <= LIMIT_S else "  too slow"
            shown = " ".join(words[:2]) if words[0] == "sql" else " ".join(words)
            print(f"  {'plancurate ' + shown:40s} {seconds:5.2f} s  {seconds / peer_s:4.1f}x{late}")
    state("slowest help or query of the command line", "s", slowest, "limit", LIMIT_S, less_is_better=True)


def helps() -> list[tuple[str, ...]]:
    """Return the words that ask for the help of the command line and of each command."""
    names = [command.rpartition(":")[2].rstrip("_") for commands in COMMANDS.values() for command in commands]
    return [("--help",), *((name, "--help") for name in names)]


def query(home: Path) -> tuple[str, ...]:
    """Return the words of a query of an empty lake, which is made here."""
    (home / "lake").mkdir()
    Lake(home / "lake").sql("SELECT 1")
    return ("sql", "SELECT 1", "--home", str(home))


def median_s(arguments: Sequence[str], runs: int) -> float:
    """Median of user and system time in s of Python with these arguments, of so many processes."""
    return statistics.median(process_s(arguments) for _ in range(runs))


def process_s(arguments: Sequence[str]) -> float:
    """User and system time in s of one Python process; CalledProcessError when it fails."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
    after = getrusage(RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)


if __name__ == "__main__":
    main()
