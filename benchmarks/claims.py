"""All claims as one table: ours, what it stands beside, how many times better, and how many times were wished.

    python benchmarks/claims.py [state_checks playback ...]

Runs the programs of this folder one after another, each as short as its medians allow, and collects the rows that
they state. Ends with exit code 1 where a claim is not kept or a program fails.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

COLLECTED = "PLANCURATE_CLAIMS"  # names the file that rows are added to
PROGRAMS: dict[str, tuple[str, ...]] = {
    "state_checks": ("--targets", "1"),
    "planners": (),
    "panda": ("--targets", "10", "--runs", "4"),
    "playback": ("--targets", "3"),
    "generate": ("--targets", "6", "--repeats", "1"),
    "curation": ("--candidates", "1000000"),
    "train": ("--networks", "12", "--steps", "60"),
    "rollouts": ("--repeats", "3"),
    "observations": ("--states", "1024"),
    "lake_reads": (),
    "command_line": ("--runs", "1"),
    "robot_fits": ("--states", "300"),
}


@dataclass(frozen=True)
class Claim:
    """A row: a figure of ours beside a peer's, or beside a stated limit."""

    what: str
    unit: str
    ours: float
    beside: str
    theirs: float
    ratio: float
    """How many times better ours is."""
    wished: float | None
    """The least ratio that was wished; None where a row only informs."""

    @property
    def kept(self) -> bool:
        """Whether the claim holds here."""
        return self.wished is None or self.ratio >= self.wished


def state(
    what: str,
    unit: str,
    ours: float,
    beside: str,
    theirs: float,
    *,
    wished: float | None = 1.0,
    less_is_better: bool = False,
) -> Claim:
    """Add a row to the table, if one is being made."""
    ratio = theirs / ours if less_is_better else ours / theirs
    claim = Claim(what, unit, ours, beside, theirs, ratio, wished)
    if path := os.environ.get(COLLECTED):
        with Path(path).open("a") as rows:
            rows.write(json.dumps(asdict(claim)) + "\n")
    return claim


def main() -> None:
    """Run the programs and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("programs", nargs="*", metavar="program", help=", ".join(PROGRAMS))
    asked = parser.parse_args().programs or list(PROGRAMS)
    if unknown := [name for name in asked if name not in PROGRAMS]:
        parser.error(f"no program {unknown[0]}; there are {', '.join(PROGRAMS)}")
    began = time.perf_counter()
    failed: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        collected = Path(folder) / "claims.jsonl"
        collected.touch()
        for name in asked:
            before = len(collected.read_text())
            status = run(name, collected)
            if status and len(collected.read_text()) == before:  # else a row says what was not kept
                failed.append(name)
        claims = [Claim(**json.loads(line)) for line in collected.read_text().splitlines()]
    used = getrusage(RUSAGE_CHILDREN)
    print(
        f"\n{machine()}; {time.perf_counter() - began:.0f} s, {used.ru_utime + used.ru_stime:.0f} s of them computing\n"
    )
    print(*table(claims), sep="\n")
    if failed:
        print(f"\nfailed: {', '.join(failed)}")
    sys.exit(bool(failed) or not all(claim.kept for claim in claims))


def run(name: str, collected: Path) -> int:
    """Run a program in one thread; its exit code."""
    program = Path(__file__).with_name(f"{name}.py")
    environment = os.environ | {COLLECTED: str(collected), "OMP_NUM_THREADS": "1"}
    print(f"\n== {name}", flush=True)
    return subprocess.run(
        [sys.executable, str(program), *PROGRAMS[name]], check=False, env=environment
    ).returncode


def table(claims: list[Claim]) -> list[str]:
    """Lines of the table, as Markdown."""
    lines = ["| claim | ours | beside | theirs | ratio | wished |", "|---|---|---|---|---|---|"]
    for claim in claims:
        wished = "" if claim.wished is None else f"{claim.wished:g}" + ("" if claim.kept else ", not kept")
        lines.append(
            f"| {claim.what}, {claim.unit} | {claim.ours:,.3g} | {claim.beside} | {claim.theirs:,.3g} "
            f"| {claim.ratio:.3g} | {wished} |"
        )
    return lines


def machine() -> str:
    """Processor and Python."""
    cpu = Path("/proc/cpuinfo")
    models = (
        [line for line in cpu.read_text().splitlines() if line.startswith("model name")]
        if cpu.exists()
        else []
    )
    name = models[0].partition(":")[2].strip() if models else platform.processor()
    return f"{name}, {os.cpu_count()} threads, Python {platform.python_version()}"


if __name__ == "__main__":
    main()
