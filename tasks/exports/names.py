"""What the formats are called; a module of its own, so that a command line starts fast."""

from __future__ import annotations

from typing import Literal

Format = Literal["robomimic", "lerobot"]
