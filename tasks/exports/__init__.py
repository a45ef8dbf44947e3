"""Curated data for other trainers: a pool's episodes, with what selections keep of them, in formats that these read."""

from __future__ import annotations

from plancurate.tasks.exports.episodes import Episodes, make_episodes
from plancurate.tasks.exports.formats import FORMATS, Format, write_export

__all__ = ["FORMATS", "Episodes", "Format", "make_episodes", "write_export"]
