"""Two made studies whose differences can be counted by hand."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

from plancurate.errors import UnknownNameError
from plancurate.flows.cli.compare import compare, field_text
from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.comparison import (
    FieldDifference,
    StudyComparison,
    compare_studies,
    field_differences,
    flattened,
)
from plancurate.tasks.study.statistics import Outcomes
from plancurate.tasks.study.text import whole_percents

from ..lakes import POOL, copied
from ..studies import StudyMaker

SETUP = {
    "name": "a",
    "n_targets": 5,
    "budgets": [20],
    "candidates": {"timing": {"dt": 0.05, "method": "spline"}},
}
KMEANS, GENERAL = ("free", "", "KMeans", 20), ("free", "", "General", None)


def successes(n: int, of: int = 20) -> str:
    """That many successes of so many trials."""
    return "S" * n + "." * (of - n)


@pytest.fixture(scope="module")
def lake_once(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """Study b leaves a policy out, has a second seed, a second budget, other timing and another OMPL."""
    lake = copied(small_lake_once, tmp_path_factory.mktemp("comparison"))
    maker = StudyMaker(lake)
    a = maker.record("a", "aaaaaaaa", config=json.dumps(SETUP))
    maker.test(a, "General", None, "BC_MLP", successes(5))
    maker.test(a, "General", None, "BC_RNN", successes(20))
    maker.test(a, "KMeans", 20, "BC_MLP", successes(10))
    maker.test(a, "Random", 20, "BC_MLP", successes(9))
    changed = {"candidates": {"timing": {"dt": 0.1, "method": "spline"}}, "budgets": [5, 20], "name": "b"}
    b = maker.record("b", "bbbbbbbb", config=json.dumps(SETUP | changed), ompl_version="2.0.1")
    maker.test(b, "General", None, "BC_MLP", successes(6))
    maker.test(b, "General", None, "BC_MLP", successes(14), seed=1)
    maker.test(b, "KMeans", 20, "BC_MLP", successes(20))
    maker.test(b, "KMeans", 5, "BC_MLP", successes(1))
    return lake


@pytest.fixture
def lake(lake_once: Lake, tmp_path: Path) -> Lake:
    """A copy of the two studies to write into."""
    return copied(lake_once, tmp_path)


def compared(lake: Lake, a: str = "a-aaaaaaaa", b: str = "b-bbbbbbbb", **choices: Any) -> StudyComparison:
    return compare_studies(lake, a, b, **choices)


@pytest.mark.slow
def test_fields_that_differ_are_named_by_their_paths(lake: Lake) -> None:
    assert compared(lake).fields == [
        FieldDifference("name", "a", "b"),
        FieldDifference("budgets", [20], [5, 20]),
        FieldDifference("candidates.timing.dt", 0.05, 0.1),
        FieldDifference("ompl_version", "1.5.2", "2.0.1"),
    ]


@pytest.mark.slow
def test_success_is_compared_over_seeds_and_the_policies_that_both_tried(lake: Lake) -> None:
    kmeans, general = compared(lake).results
    assert (kmeans.cell, general.cell) == (KMEANS, GENERAL)
    assert (kmeans.a, kmeans.b) == (Outcomes(10, 20), Outcomes(20, 20))
    assert (general.a, general.b) == (Outcomes(5, 20), Outcomes(20, 40))  # a's BC_RNN is left out
    assert general.policies == ("BC_MLP",)
    assert general.difference == 0.25
    assert general.a_interval.low < 0.25 < general.a_interval.high
    # Two seeds with 6 and 14 of 20 vary more than chance would.
    assert general.b_interval.high - general.b_interval.low > 0.4


@pytest.mark.slow
def test_differences_are_tested_and_adjusted_for_all_rows(lake: Lake) -> None:
    kmeans, general = compared(lake).results
    # The same 20 tests: b alone reaches 10 of them, and of 2 imagined ones each study reaches one alone.
    variance = (12 / 22 - (10 / 22) ** 2) / 21
    assert kmeans.p == pytest.approx(2 * stats.norm.sf(10 / 22 / math.sqrt(variance)), rel=0.4)
    assert kmeans.p_holm == pytest.approx(2 * kmeans.p)
    assert general.p_holm == pytest.approx(general.p)
    assert (kmeans.stars, general.stars) == ("***", "ns")
    assert kmeans.interval.low > 0.2


@pytest.mark.slow
def test_tests_at_other_places_are_drawn_apart(lake: Lake) -> None:
    maker = StudyMaker(lake)
    elsewhere = maker.record("c", "cccccccc")
    maker.test(elsewhere, "KMeans", 20, "BC_MLP", successes(20), x=0.1)
    (row,) = compared(lake, b=elsewhere).results
    # Each study's targets vary on their own; 2 imagined ones: a has 10 + 1 of 22 one way, c 20 + 1.
    variances = [11 * 11 / 22 / 21 / 22, 21 * 1 / 22 / 21 / 22]
    z = (21 / 22 - 11 / 22) / math.sqrt(sum(variances))
    # Drawn from all 40, the number of each study's own varies a little too.
    assert stats.norm.isf(row.p / 2) == pytest.approx(z, rel=0.1)
    (paired, _) = compared(lake).results
    assert paired.difference == row.difference


@pytest.mark.slow
def test_what_went_over_other_scenes_is_not_compared_over_all(lake: Lake) -> None:
    maker = StudyMaker(lake)
    table, shelf = ({**POOL, "scene": scene, "pool": scene} for scene in ("table", "shelf"))
    studies = [
        maker.record(name, f"{name}{name}", pools=((POOL, ""), (other, "")))
        for name, other in (("m", table), ("n", shelf))
    ]
    for study, other in zip(studies, (table, shelf), strict=True):
        for pool in (POOL, other):
            maker.test(study, "KMeans", 20, "BC_MLP", successes(10), pool=pool)
    assert [row.scene for row in compared(lake, *studies).results] == ["free"]
    assert [row.scene for row in compared(lake, studies[0], studies[0]).results] == [
        "all scenes",
        "free",
        "table",
    ]


@pytest.mark.slow
def test_turned_round_the_differences_change_their_signs(lake: Lake) -> None:
    there = {row.selector: row for row in compared(lake).results}
    back = {row.selector: row for row in compared(lake, "b-bbbbbbbb", "a-aaaaaaaa").results}
    for selector, row in there.items():
        assert back[selector].difference == pytest.approx(-row.difference)
        assert back[selector].interval.low == pytest.approx(-row.interval.high, abs=0.03)


def test_selections_of_only_one_study_are_named(lake: Lake) -> None:
    found = compared(lake)
    assert (found.only_a, found.only_b) == ([("free", "", "Random", 20)], [("free", "", "KMeans", 5)])


@pytest.mark.slow
def test_a_study_does_not_differ_from_itself(lake: Lake) -> None:
    found = compared(lake, b="a-aaaaaaaa")
    assert (found.fields, found.only_a, found.only_b) == ([], [], [])
    assert [(row.difference, row.p_holm) for row in found.results] == [(0.0, 1.0)] * 3
    assert found.repeated == 3


@pytest.mark.slow
def test_rates_outside_the_interval_of_before_are_not_repeated(lake: Lake) -> None:
    maker = StudyMaker(lake)
    again = maker.record("again", "cccccccc")
    maker.test(again, "General", None, "BC_MLP", successes(6))  # 5 of 20 before
    maker.test(again, "KMeans", 20, "BC_MLP", successes(20))  # 10 of 20
    found = compared(lake, b=again)
    assert (found.repeated, len(found.results)) == (1, 2)


@pytest.mark.slow
def test_unseen_targets_are_compared_apart(lake: Lake) -> None:
    for study, n in (("a-aaaaaaaa", 3), ("b-bbbbbbbb", 4)):
        StudyMaker(lake).test(study, "KMeans", 20, "BC_MLP", successes(n, 8), kind="unseen")
    (row,) = compared(lake, kind="unseen").results
    assert (row.a, row.b) == (Outcomes(3, 8), Outcomes(4, 8))


@pytest.mark.slow
def test_a_selection_without_a_common_policy_is_not_compared(lake: Lake) -> None:
    maker = StudyMaker(lake)
    other = maker.record("c", "cccccccc")
    maker.test(other, "KMeans", 20, "BC_RNN", "S")
    assert compared(lake, b=other).results == []


def test_an_unknown_study_is_refused_wherever_it_stands(lake: Lake) -> None:
    for pair in (("a-aaaaaaaa", "zz"), ("zz", "a-aaaaaaaa")):
        with pytest.raises(UnknownNameError, match="unknown study 'zz'"):
            compared(lake, *pair)


def test_nested_fields_have_dotted_paths_and_lists_stay_whole() -> None:
    nested = {"a": {"b": {"c": 1}, "d": [1, 2]}, "e": {}}
    assert flattened(nested) == {"a.b.c": 1, "a.d": [1, 2]}


def test_a_field_that_only_one_study_has_is_unset_in_the_other() -> None:
    assert field_differences({"a": 1, "same": 2}, {"same": 2, "b": [3]}) == [
        FieldDifference("a", 1, None),
        FieldDifference("b", None, [3]),
    ]
    assert field_differences({"null": None}, {}) == []


def said(capsys: pytest.CaptureFixture[str], lake: Lake, *studies: str, **choices: Any) -> str:
    """What the command prints about two studies."""
    compare(*studies, **choices, options=HomeOptions(home=lake.root.parent))
    return capsys.readouterr().out


@pytest.mark.slow
def test_the_command_shows_setup_results_and_what_only_one_study_has(
    lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [" ".join(line.split()) for line in said(capsys, lake, "a", "b").splitlines()]
    for line in ("A a-aaaaaaaa", "candidates.timing.dt 0.05 0.1", "budgets also 5", "only in A: Random k=20"):
        assert line in lines
    kmeans, general = compared(lake).results
    (shown,) = [line for line in lines if line.startswith("KMeans 20")]
    assert shown == (
        f"KMeans 20 50.0 {whole_percents(kmeans.a_interval)} 100.0 {whole_percents(kmeans.b_interval)} "
        f"+50.0 {whole_percents(kmeans.interval)} {kmeans.p_holm:.2g} ***"
    )
    (shown,) = [line for line in lines if line.startswith("General all")]
    assert shown.endswith(f"+25.0 {whole_percents(general.interval)} {general.p_holm:.2g} ns")


@pytest.mark.slow
def test_the_command_writes_the_same_as_json_and_markdown(
    lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    found = compared(lake)
    values = json.loads(said(capsys, lake, "a", "b", format="json"))
    assert [row["p_holm"] for row in values["results"]] == [row.p_holm for row in found.results]
    assert values["results"][0]["stars"] == "***"
    assert values["only_b"] == [{"scene": "free", "pool_label": "", "selector": "KMeans", "budget": 5}]
    page = said(capsys, lake, "a", "b", format="markdown")
    assert "| candidates.timing.dt | 0.05 | 0.1 |" in page
    assert f"| KMeans | 20 | 50.0 {whole_percents(found.results[0].a_interval)} |" in page
    assert "policies that both tried (BC_MLP)" in page
    assert f"B lies inside A's interval in {found.repeated} of 2 rows." in page
    assert values["repeated"] == found.repeated


@pytest.mark.slow
def test_the_command_takes_keys_of_earlier_studies(lake: Lake, capsys: pytest.CaptureFixture[str]) -> None:
    maker = StudyMaker(lake)
    later = maker.record("a", "ffffffff", run_at=datetime(2027, 1, 1, tzinfo=UTC))
    maker.test(later, "General", None, "BC_MLP", "S")
    assert "A  a-ffffffff\nB  b-bbbbbbbb" in said(capsys, lake, "a", "b")
    assert "A  a-ffffffff\nB  a-aaaaaaaa" in said(capsys, lake, "a", "a", key_b="aaaaaaaa")
    assert "A  a-aaaaaaaa\nB  b-bbbbbbbb" in said(capsys, lake, "a", "b", key_a="aaaaaaaa")
    with pytest.raises(UnknownNameError, match="unknown key of study b 'aaaaaaaa': valid are bbbbbbbb"):
        said(capsys, lake, "a", "b", key_b="aaaaaaaa")


@pytest.mark.slow
def test_the_command_says_when_nothing_differs_or_nothing_is_shared(
    lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    for format in ("table", "markdown"):
        assert "set up alike" in said(capsys, lake, "a", "a", format=format)
        nothing = said(capsys, lake, "a", "b", format=format, kind="unseen")
        assert "No selection was tested with the same policy" in nothing


def test_of_two_lists_only_what_differs_is_shown_unless_it_is_their_order() -> None:
    assert field_text(FieldDifference("x", [1, 2], [2, 3])) == ("also 1", "also 3")
    assert field_text(FieldDifference("x", ["p"], ["p", "q"])) == ("", "also q")
    assert field_text(FieldDifference("x", [1, 2], [2, 1])) == ("[1, 2]", "[2, 1]")
    assert field_text(FieldDifference("x", None, True)) == ("unset", "true")
