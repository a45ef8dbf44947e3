"""The verdict in sentences: which selection, how sure, what next."""

from __future__ import annotations

from typing import Any

import pytest

from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.verdict import Verdict, verdicts

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}
GOOD, BAD = 39 * "S" + ".", 8 * "S" + 32 * "."


def the_verdict(lake: Lake, study: str) -> Verdict:
    (verdict,) = verdicts(study_results(lake, study))
    return verdict


@pytest.mark.slow
def test_a_clear_winner_is_named_with_its_gain_and_how_to_get_it(small_lake: Lake, maker: Any) -> None:
    study = maker.record("clear", "aaaaaaaa")
    for seed in (0, 1):
        maker.test(study, "KMeans", 2, "BC_MLP", GOOD, seed=seed)
        maker.test(study, "General", None, "BC_MLP", BAD, seed=seed)
    verdict = the_verdict(small_lake, study)
    assert [row.selector for row in verdict.best] == ["KMeans"]
    assert verdict.which.startswith("KMeans k=2 is the best selection: 97.5 % [")
    assert verdict.which.endswith("] of 80 tests at targets up to 5 cm from a trained one succeed.")
    assert verdict.sure.startswith("General, which keeps every candidate, reaches 20.0 %: +77.5 points [")
    assert "p = < 0.001" not in verdict.sure
    assert "p < 0.001, more than chance" in verdict.sure
    assert verdict.sure.endswith("covers other training seeds and targets.")
    assert verdict.steps == [
        "Every selection was drawn once; several `selection_seeds` would show what another draw changes.",
        "Its trajectories: SELECT * FROM selections WHERE study = 'clear-aaaaaaaa' AND selector = 'KMeans' "
        "AND budget = 2",
    ]


@pytest.mark.slow
def test_ties_are_named_as_ties_and_the_cheapest_of_them_is_chosen(small_lake: Lake, maker: Any) -> None:
    study = maker.record("ties", "aaaaaaaa")
    for i, selector in enumerate(("A", "B", "C", "D", "E")):
        maker.test(study, selector, 2, "BC_MLP", "." * i + GOOD[i:], selection_time_s=5.0 - i)
    maker.test(study, "Bad", 2, "BC_MLP", BAD)
    verdict = the_verdict(small_lake, study)
    assert verdict.which.startswith(
        "5 selections tie for the best: A k=2, B k=2, C k=2, D k=2 and 1 more. A k=2 leads"
    )
    assert verdict.which.endswith("the tests can't tell it from the others, down to 87.5 %.")
    assert "whether selecting helps is open" in verdict.sure
    assert any("Of them E k=2 takes the least time to select (1 s)" in step for step in verdict.steps)


@pytest.mark.slow
def test_where_nothing_beats_general_it_says_so(small_lake: Lake, maker: Any) -> None:
    study = maker.record("general", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", GOOD)
    maker.test(study, "Random", 2, "BC_MLP", BAD)
    verdict = the_verdict(small_lake, study)
    assert verdict.sure.startswith("No selection beats General")
    assert verdict.steps[-1].endswith("selector = 'General' AND budget IS NULL")


def test_a_gain_that_may_be_chance_is_called_so(small_lake: Lake, maker: Any) -> None:
    study = maker.record("chance", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "S...S...")
    maker.test(study, "Random", 2, "BC_MLP", "SS..S...")
    verdict = the_verdict(small_lake, study)
    assert "it may be chance" in verdict.sure
    assert len(verdict.best) == 2


@pytest.mark.slow
def test_a_degenerate_pool_is_called_so_first(small_lake: Lake, maker: Any) -> None:
    for run in range(4):
        same = {"joint_movement": 1.0, "path_length": 1.0, "smoothness": 1.0}
        maker.plan("EST", 0, key=str(run), run=run, trajectory_id=f"copy{run}", **same)
    study = maker.record("copies", "aaaaaaaa", planners=["EST"], n_targets=1)
    maker.test(study, "General", None, "BC_MLP", "S")
    assert "scene free is degenerate: only 1 of its 4 candidates" in the_verdict(small_lake, study).steps[0]


@pytest.mark.slow
@pytest.mark.parametrize("labels", [("", ""), ("pose", "nearest")])
def test_scenes_have_one_verdict_and_variants_one_each(
    small_lake: Lake, maker: Any, labels: tuple[str, str]
) -> None:
    study = maker.record("several", "aaaaaaaa", pools=((FREE, labels[0]), (TABLE, labels[1])))
    for pool in (FREE, TABLE):
        maker.test(study, "General", None, "BC_MLP", BAD, pool=pool)
        maker.test(study, "KMeans", 2, "BC_MLP", GOOD, pool=pool)
    found = [verdict.which.partition(":")[0] for verdict in verdicts(study_results(small_lake, study))]
    assert found == (["all scenes"] if labels == ("", "") else ["scene free, pose", "scene table, nearest"])
