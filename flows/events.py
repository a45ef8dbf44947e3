"""Events on Prefect's pages: what came into a home folder, for people to see and for automations to wait for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from prefect.events import emit_event

from plancurate.tasks.study import text
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.selection_rows import PoolRow

POOL_READY = "plancurate.pool.ready"
STUDY_PUBLISHED = "plancurate.study.published"


def tell_pool_ready(study: StudyContext, pool: PoolRow) -> None:
    """Say that all candidates of a study's pool are in the lake; the payload counts them."""
    resource = ".".join(filter(None, ["pool", study.study, pool.scene, pool.pool_label]))
    _emit(POOL_READY, resource, text.group(pool), asdict(pool))


def tell_study_published(study: str, verdict: Sequence[str]) -> None:
    """Say that a study's results are in MLflow and in its report; the payload holds the verdict."""
    _emit(STUDY_PUBLISHED, f"study.{study}", study, {"verdict": list(verdict)})


def _emit(event: str, resource: str, name: str, payload: dict[str, object]) -> None:
    resource_id = f"plancurate.{resource}"
    emit_event(event, {"prefect.resource.id": resource_id, "prefect.resource.name": name}, payload=payload)
