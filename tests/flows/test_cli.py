"""The command line before anything runs: what it says of itself, and what saying it costs."""

from __future__ import annotations

import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest

from plancurate.flows.cli.app import COMMANDS, FAMILIES, functions, main
from plancurate.tasks.lake.store import Lake

NAMES = [command for commands in COMMANDS.values() for command in commands if command not in FAMILIES]
IN_FAMILIES = [(family, command) for family, (_, commands) in FAMILIES.items() for command in commands]
# Each takes from a third of a second to seconds to import.
HEAVY = {
    "matplotlib", "mlflow", "pandas", "prefect", "pybullet", "scipy", "sklearn", "statsmodels", "toppra", "torch",
}  # fmt: skip
RUN = """
import contextlib, json, sys
from plancurate.flows.cli.app import main
for words in json.loads(sys.argv[1]):
    with contextlib.suppress(SystemExit):
        main(words)
json.dump(sorted(sys.modules), sys.stderr)
"""


def run(*calls: list[str]) -> tuple[str, set[str]]:
    """Call the command line in a new process; return what it printed and what is imported by then."""
    done = subprocess.run(
        [sys.executable, "-c", RUN, json.dumps(calls)], capture_output=True, text=True, check=True
    )
    return done.stdout, set(json.loads(done.stderr))


@pytest.mark.slow
def test_no_help_imports_what_is_heavy() -> None:
    calls = [["--help"], *([command.partition(":")[2].rstrip("_"), "--help"] for command in NAMES)]
    calls += [[family, "--help"] for family in FAMILIES]
    calls += [[family, command.partition(":")[2], "--help"] for family, command in IN_FAMILIES]
    said, modules = run(*calls)
    assert said.count("Usage: plancurate") == len(calls)
    assert HEAVY & modules == set()


@pytest.mark.slow
def test_sql_needs_duckdb_and_arrow_alone(tmp_path: Path) -> None:
    lake = Lake(tmp_path / "lake")
    lake.root.mkdir()
    lake.sql("SELECT 1")  # its first reader lays it out, for which Arrow imports pandas
    query = ["sql", "SELECT 41 + count(*) + 1 AS x FROM trajectories", "--home", str(tmp_path), "--format"]
    said, modules = run(*([*query, format] for format in ("table", "csv", "json")))
    assert said.count("42") == 3
    assert {"duckdb", "pyarrow"} <= modules
    assert (HEAVY | {"jinja2", "plancurate.robots", "plancurate.tasks.study"}) & modules == set()


def test_every_command_is_described_by_its_docstring(capsys: pytest.CaptureFixture[str]) -> None:
    for command in [*NAMES, *(command for _, command in IN_FAMILIES)]:
        module, _, name = command.partition(":")
        function = getattr(importlib.import_module(f"plancurate.flows.cli.{module}"), name)
        assert functions(module)[name] == inspect.getdoc(function)
    with pytest.raises(SystemExit):
        main(["--help"])
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for command in NAMES:
        module, _, name = command.partition(":")
        assert f"{name.rstrip('_')} {functions(module)[name].partition(chr(10))[0]}" in said
    for family, (help, commands) in FAMILIES.items():
        assert f"{family} {help}" in said
        with pytest.raises(SystemExit):
            main([family, "--help"])
        shown = " ".join(capsys.readouterr().out.replace("│", " ").split())
        for module, name in (command.split(":") for command in commands):
            assert f"{name} {functions(module)[name].partition(chr(10))[0]}" in shown


def test_what_a_query_returns_is_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lake").mkdir()
    query = """SELECT 0.1::DOUBLE AS real, 1.5::DECIMAL(4, 2) AS decimal, 'nan'::DOUBLE AS none, TRUE AS yes,
        NULL AS nothing, [1, 2] AS list, {'a': 'b'} AS struct, DATE '2026-01-02' AS day,
        TIMESTAMP '2026-01-02 03:04:05' AS time, INTERVAL 1 DAY AS interval"""
    with pytest.raises(SystemExit):
        main(["sql", query, "--format", "json", "--home", str(tmp_path)])
    row = json.loads(capsys.readouterr().out)[0]
    assert row.pop("interval")
    assert row == {
        "real": 0.1, "decimal": 1.5, "none": None, "yes": True, "nothing": None, "list": [1, 2],
        "struct": {"a": "b"}, "day": "2026-01-02", "time": "2026-01-02T03:04:05",
    }  # fmt: skip
