"""The results of a study from what is held are those from the lake, whatever happens to its files meanwhile."""

from __future__ import annotations

import shutil

import pytest

from plancurate.sql import load, names
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.held import held
from plancurate.tasks.lake.store import Lake

from ..lakes import POOL
from ..studies import StudyMaker

QUERIES = [(name, kind) for name in names("results") for kind in ("displaced", "unseen")]


@pytest.fixture
def study(maker: StudyMaker) -> str:
    """A study of two selections with trials of both kinds, and another one with more of them."""
    for name, seeds in (("other", 3), ("tiny", 2)):
        study = maker.record(name, "aaaaaaaa")
        for selector, outcomes in (("General", "S.CL"), ("Random", "SSR.")):
            maker.select(study, selector, 2, [(0, "PRM", 0), (1, "PRM", 0)])
            for seed in range(seeds):
                for kind in ("displaced", "unseen"):
                    maker.test(study, selector, 2, "BC_MLP", outcomes, seed=seed, kind=kind)
    return study


def answers(lake: Lake, study: str) -> list[object]:
    """Rows of every query of results."""
    asked = []
    for name, kind in QUERIES:
        values = {"study": study, "kind": kind}
        asked.append(lake.query(name, **{key: values[key] for key in values if f"${key}" in load(name)}))
    return asked


def test_every_query_is_answered_as_the_lake_answers(small_lake: Lake, study: str) -> None:
    with held(small_lake, study) as one:
        assert answers(one, study) == answers(small_lake, study)
        assert answers(one, "other-aaaaaaaa") == answers(small_lake, "other-aaaaaaaa")


def test_trials_are_read_once(small_lake: Lake, study: str) -> None:
    before = small_lake.query("results/outcomes", study=study, kind="unseen")
    with held(small_lake, study) as one:
        shutil.rmtree(small_lake.root / "evaluations" / "robot=h2017")
        assert one.query("results/outcomes", study=study, kind="unseen") == before


def test_parts_that_are_merged_meanwhile_are_found_again(small_lake: Lake, study: str) -> None:
    before = answers(small_lake, study)
    with held(small_lake, study) as one:
        for _ in range(2):
            compact(small_lake, "selections", {**POOL, "study": study}, {}, grace_s=0)
        assert answers(one, study) == before
