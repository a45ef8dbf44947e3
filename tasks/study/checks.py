"""What a study checks of itself when it is over."""

from __future__ import annotations

from plancurate.tasks.lake.audits import failed_audits
from plancurate.tasks.study.context import StudyContext


def audit_study(study: StudyContext) -> list[str]:
    """Run the audits over what the study wrote; returns a line for each that found something."""
    return [
        f"sql/audits/{name}.sql: {rows} rows of {pool.title} break what must hold"
        for pool in study.pools
        for name, rows in failed_audits(study.lake, study.study_partition(pool)).items()
    ]
