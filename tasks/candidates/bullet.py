"""PyBullet, imported without the greeting that it writes to the error stream."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def _muted_stderr() -> Iterator[None]:
    """Send what C code writes to the error stream nowhere."""
    kept = os.dup(2)
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


with _muted_stderr():
    import pybullet as bullet

__all__ = ["bullet"]
