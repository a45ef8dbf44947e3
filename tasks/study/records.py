"""Note in the lake what a study is, so that its results can be found by its name."""

from __future__ import annotations

from datetime import UTC, datetime

import pyarrow as pa

from plancurate import __version__, native
from plancurate.tasks.lake.schema import table
from plancurate.tasks.study.context import StudyContext


def record_study(study: StudyContext) -> None:
    """Make the study the latest of its name, unless it is already."""
    latest = study.lake.query("study/latest", study_name=study.config.name).to_pylist()
    if latest and latest[0]["study"] == study.study:
        return
    now = datetime.now(UTC)
    config = study.config
    rows = [
        {
            "name": config.name,
            "study_key": study.key,
            "config": config.model_dump_json(),
            "robot": pool.robot.name,
            "scene": pool.scene.name,
            "pool": pool.pool,
            "pool_label": pool.label,
            "planners": list(study.sources),
            "labelling": study.labelling,
            "n_targets": config.n_targets,
            "run_at": now,
            "package_version": __version__,
            "ompl_version": native.ompl_version(),
        }
        for pool in study.pools
    ]
    key = f"{now:%Y%m%dT%H%M%S%f}"
    parts = pa.Table.from_pylist(rows, table("studies").schema)
    study.lake.write("studies", {"study": study.study}, key, parts, study.metadata)
