"""Packages of others: one file each, found by an entry point as an installed package's are."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, ModuleType], None]]:
    """Install a file that registers something with a registry, such as the module `policies.policy`."""
    used: list[ModuleType] = []

    def install_file(source: str, registry: ModuleType) -> None:
        (tmp_path / "of_others.py").write_text(source)
        described = tmp_path / "of_others-1.0.dist-info"
        described.mkdir()
        (described / "METADATA").write_text("Metadata-Version: 2.1\nName: of-others\nVersion: 1.0\n")
        (described / "entry_points.txt").write_text(f"[{registry.ENTRY_POINTS}]\nmine = of_others\n")
        monkeypatch.syspath_prepend(tmp_path)
        registry._discover()
        monkeypatch.setattr(registry, "_registry", dict(registry._registry))
        registry._discover.cache_clear()
        used.append(registry)

    yield install_file
    sys.modules.pop("of_others", None)
    for registry in used:
        registry._discover.cache_clear()
