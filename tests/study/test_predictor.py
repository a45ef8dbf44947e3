"""Which network of a study predicts."""

from __future__ import annotations

from typing import Any

import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.predictor import Choice, chosen_row

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}


def outcomes(successes: int) -> str:
    return successes * "S" + (40 - successes) * "."


@pytest.fixture
def study(maker: Any) -> str:
    """KMeans is best, above all with BC_RNN, of which the second seed succeeds more often; General is best with one."""
    name = str(maker.record("some", "aaaaaaaa"))
    for policy, selector, seed, successes in (
        ("BC_MLP", "KMeans", 0, 30),
        ("BC_MLP", "KMeans", 1, 40),
        ("BC_RNN", "KMeans", 0, 36),
        ("BC_RNN", "KMeans", 1, 38),
        ("BC_MLP", "General", 0, 40),
        ("BC_RNN", "General", 0, 2),
    ):
        budget = 2 if selector == "KMeans" else None
        maker.test(name, selector, budget, policy, outcomes(successes), seed=seed)
    return name


def chosen(lake: Lake, study: str, **asked: str) -> tuple[str, str, int]:
    row = chosen_row(lake, study, Choice(study, **asked))
    return row.selector, row.policy, row.seed


@pytest.mark.slow
def test_the_verdict_s_selection_with_its_best_policy_and_seed_predicts(small_lake: Lake, study: str) -> None:
    assert chosen(small_lake, study) == ("KMeans", "BC_RNN", 1)


@pytest.mark.slow
def test_what_is_asked_for_is_taken_and_the_rest_the_best(small_lake: Lake, study: str) -> None:
    assert chosen(small_lake, study, policy="BC_MLP") == ("KMeans", "BC_MLP", 1)
    assert chosen(small_lake, study, selector="General") == ("General", "BC_MLP", 0)
    assert chosen(small_lake, study, selector="General", policy="BC_RNN") == ("General", "BC_RNN", 0)
    assert chosen(small_lake, study, selector="KMeans k=2") == ("KMeans", "BC_RNN", 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"selector": "KMean"}, "unknown selector of study some-aaaaaaaa 'KMean': did you mean KMeans"),
        ({"policy": "BC"}, "unknown policy of study some-aaaaaaaa 'BC'"),
        ({"scene": "shelf"}, "unknown scene of study some-aaaaaaaa 'shelf'"),
    ],
)
def test_names_that_the_study_does_not_have_are_refused(
    small_lake: Lake, study: str, asked: dict[str, str], said: str
) -> None:
    with pytest.raises(PlancurateError, match=said):
        chosen(small_lake, study, **asked)


@pytest.mark.slow
def test_only_networks_after_the_last_round_of_corrections_predict(small_lake: Lake, maker: Any) -> None:
    name = maker.record("corrected", "aaaaaaaa")
    maker.test(name, "General", None, "BC_MLP", outcomes(40), round=0)
    maker.test(name, "General", None, "BC_MLP", outcomes(30), round=1)
    assert chosen_row(small_lake, name, Choice(name)).round == 1


@pytest.mark.slow
def test_of_several_scenes_one_must_be_named(small_lake: Lake, maker: Any) -> None:
    name = maker.record("two", "aaaaaaaa", [(FREE, ""), (TABLE, "")])
    for pool, policy in ((FREE, "BC_MLP"), (TABLE, "BC_RNN")):
        for each in ("BC_MLP", "BC_RNN"):
            good = outcomes(39 if each == policy else 20)
            maker.test(name, "General", None, each, good, pool=pool)
    with pytest.raises(PlancurateError, match="free, table; say which one with --scene"):
        chosen(small_lake, name)
    assert chosen(small_lake, name, scene="free") == ("General", "BC_MLP", 0)
    assert chosen(small_lake, name, scene="table") == ("General", "BC_RNN", 0)


def test_a_study_that_tested_nothing_has_no_policy(small_lake: Lake, maker: Any) -> None:
    name = maker.record("empty", "aaaaaaaa")
    with pytest.raises(PlancurateError, match="nothing is tested yet"):
        chosen(small_lake, name)
