"""Each folder of the native code includes only the folders below it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

NATIVE = Path(__file__).parents[2] / "native"
BELOW = {
    "vector": set(),
    "collision": {"vector"},
    "planning": {"collision", "vector"},
    "bindings": {"planning", "collision", "vector"},
}


def test_every_source_file_lies_in_a_known_folder() -> None:
    sources = [*NATIVE.rglob("*.hpp"), *NATIVE.rglob("*.cpp")]
    assert {file.relative_to(NATIVE).parts[0] for file in sources} == set(BELOW)


@pytest.mark.parametrize("folder", BELOW)
def test_a_folder_includes_only_those_below_it(folder: str) -> None:
    for file in (NATIVE / folder).iterdir():
        included = re.findall(r'#include "([^"]+)"', file.read_text())
        assert {name.partition("/")[0] for name in included} <= BELOW[folder] | {folder}, file.name
