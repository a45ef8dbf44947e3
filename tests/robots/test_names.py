"""The package knows robots and scenes by what their folders hold, never by what they are called."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from plancurate.robots import robot_names, scene_names

REPOSITORY = Path(__file__).parents[2]
FOLDERS = ("flows", "native", "sql", "tasks")
CODE = [
    file
    for folder in FOLDERS
    for kind in ("py", "cpp", "hpp", "sql")
    for file in sorted((REPOSITORY / folder).rglob(f"*.{kind}"))
]
OF_TABLES = ("flows/cli", "tasks/lake")
"""Where `table` is what a command prints or the lake holds."""


def test_code_is_found_in_every_folder() -> None:
    assert {file.relative_to(REPOSITORY).parts[0] for file in CODE} == set(FOLDERS)


@pytest.mark.slow
@pytest.mark.parametrize("file", CODE, ids=lambda file: str(file.relative_to(REPOSITORY)))
def test_no_robot_is_named_in_code_or_in_its_comments(file: Path) -> None:
    named = re.compile("|".join(robot_names()), re.IGNORECASE)
    assert not named.findall(file.read_text(encoding="utf-8").replace("pandas", ""))


@pytest.mark.slow
@pytest.mark.parametrize(
    "file", [f for f in CODE if f.suffix == ".py"], ids=lambda file: str(file.relative_to(REPOSITORY))
)
def test_no_scene_is_named_in_code(file: Path) -> None:
    of_tables = any(file.is_relative_to(REPOSITORY / folder) for folder in OF_TABLES)
    strings = {
        node.value
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    assert strings.isdisjoint(set(scene_names()) - ({"table"} if of_tables else set()))
