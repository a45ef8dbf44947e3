"""The results of a study from what is held are those from the lake, whatever happens to its files meanwhile."""

from __future__ import annotations

import shutil

import pyarrow as pa
import pytest

from plancurate.sql import load, names
from plancurate.tasks.lake.compact import compact
from plancurate.tasks.lake.held import held
from plancurate.tasks.lake.store import Lake

from ..lakes import POOL
from ..studies import StudyMaker

QUERIES = [name for name in names("results") if name != "results/studies"]  # which asks for no study


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


def answer(lake: Lake, study: str, name: str) -> pa.Table:
    """Rows of a query of a study's results, of those of trials on unseen targets."""
    return lake.query(name, study=study, **({"kind": "unseen"} if "$kind" in load(name) else {}))


@pytest.mark.slow
def test_every_query_is_answered_as_the_lake_answers(small_lake: Lake, study: str) -> None:
    with held(small_lake, study) as one:
        for name in QUERIES:
            assert answer(one, study, name) == answer(small_lake, study, name)
        other, name = "other-aaaaaaaa", "results/tests"
        assert answer(one, other, name) == answer(small_lake, other, name)


@pytest.mark.slow
def test_trials_are_read_once(small_lake: Lake, study: str) -> None:
    before = answer(small_lake, study, "results/outcomes")
    with held(small_lake, study) as one:
        shutil.rmtree(small_lake.root / "evaluations" / "robot=h2017")
        assert answer(one, study, "results/outcomes") == before


@pytest.mark.slow
def test_parts_that_are_merged_meanwhile_are_found_again(small_lake: Lake, study: str) -> None:
    before = answer(small_lake, study, "results/coverage")
    with held(small_lake, study) as one:
        for _ in range(2):
            compact(small_lake, "selections", {**POOL, "study": study}, {}, grace_s=0)
        assert answer(one, study, "results/coverage") == before
