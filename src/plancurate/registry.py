"""Import what registers itself by name: the modules of a package, and what installed entry points name."""

from __future__ import annotations

import importlib
import pkgutil
from importlib.metadata import entry_points


def discover(package: str, group: str) -> None:
    """Import every module of the package and load every installed entry point of the group."""
    path = importlib.import_module(package).__path__
    for module in pkgutil.iter_modules(path, f"{package}."):
        importlib.import_module(module.name)
    for entry in entry_points(group=group):
        entry.load()
