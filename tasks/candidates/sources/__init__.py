"""Sources of trajectories: OMPL's planners and whatever else yields a path to a target."""

from plancurate.tasks.candidates.sources.base import (
    PlannedPath,
    Source,
    find_source,
    source,
    source_names,
)

__all__ = ["PlannedPath", "Source", "find_source", "source", "source_names"]
