"""Processes for tests in which several work on one lake or die at it.

They are forked from a process that has imported what takes long, so that each begins within milliseconds.
"""

from __future__ import annotations

from multiprocessing import get_context

processes = get_context("forkserver")
processes.set_forkserver_preload(["pytest", "plancurate.tasks.lake.compact", "plancurate.tasks.lake.mend"])
