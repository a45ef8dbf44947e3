"""Two made studies whose differences can be counted by hand."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import pyarrow as pa
import pytest
from scipy import stats

from plancurate.errors import UnknownNameError
from plancurate.flows.cli.compare import compare, field_text
from plancurate.flows.cli.options import HomeOptions
from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.study.comparison import (
    FieldDifference,
    compare_studies,
    field_differences,
    flattened,
    rate_differences,
)
from plancurate.tasks.study.statistics import Outcomes, rate_difference, wilson_interval

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
SETUP = {
    "name": "a",
    "n_targets": 5,
    "budgets": [20],
    "candidates": {"timing": {"dt": 0.05, "method": "spline"}},
}
Cell = tuple[str, int | None, str, int]
"""Selector, budget, policy, training seed."""


def add_study(
    lake: Lake,
    name: str,
    config: Mapping[str, Any],
    cells: Mapping[Cell, tuple[int, int]],
    *,
    kind: str = "displaced",
    ompl_version: str = "1.5.2",
) -> None:
    """Record a study and, for each cell, that many successes of that many trials."""
    study = {
        "study_key": "k", "config": json.dumps(config), **POOL, "package_version": "0.1.0",
        "created_at": datetime(2026, 1, 1, tzinfo=UTC), "ompl_version": ompl_version,
    }  # fmt: skip
    lake.write("studies", {"study": name}, "k", pa.Table.from_pylist([study], table("studies").schema), {})
    for number, ((selector, budget, policy, seed), (successes, n)) in enumerate(cells.items()):
        rows = [
            {
                "evaluation_id": f"{name}{number}", "selection_id": f"{selector}-1", "selector": selector,
                "budget": budget, "policy": policy, "seed": seed, "n_kept": 4, "selection_time_s": 0.5,
                "train_s": 1.0, "test_id": i, "kind": kind, "target_id": 0, "distance_cm": 0,
                "x": 0.0, "y": 0.0, "z": 0.0, "success": i < successes, "settled": False,
                "reached": i < successes, "collided": False, "out_of_limits": False, "steps": 10,
                "final_distance": 0.1, "path_length": 1.0, "joint_movement": 2.0, "settled_distance": 0.1,
            }
            for i in range(n)
        ]  # fmt: skip
        part = pa.Table.from_pylist(rows, table("evaluations").schema)
        lake.write("evaluations", {**POOL, "study": f"{name}-k"}, f"e{number}", part, {})


@pytest.fixture
def lake(small_lake: Lake) -> Lake:
    """Study b leaves a policy out, has a second seed, a second budget, other timing and another OMPL."""
    first = {
        ("General", None, "BC_MLP", 0): (5, 20),
        ("General", None, "BC_RNN", 0): (20, 20),
        ("KMeans", 20, "BC_MLP", 0): (12, 20),
        ("Random", 20, "BC_MLP", 0): (9, 20),
    }
    second = {
        ("General", None, "BC_MLP", 0): (6, 20),
        ("General", None, "BC_MLP", 1): (14, 20),
        ("KMeans", 20, "BC_MLP", 0): (20, 20),
        ("KMeans", 5, "BC_MLP", 0): (1, 20),
    }
    changed = {"candidates": {"timing": {"dt": 0.1, "method": "spline"}}, "budgets": [5, 20], "name": "b"}
    add_study(small_lake, "a", SETUP, first)
    add_study(small_lake, "b", SETUP | changed, second, ompl_version="2.0.1")
    return small_lake


def test_fields_that_differ_are_named_by_their_paths(lake: Lake) -> None:
    assert compare_studies(lake, "a", "b").fields == [
        FieldDifference("name", "a", "b"),
        FieldDifference("budgets", [20], [5, 20]),
        FieldDifference("candidates.timing.dt", 0.05, 0.1),
        FieldDifference("ompl_version", "1.5.2", "2.0.1"),
    ]


def test_success_is_compared_over_seeds_and_the_policies_that_both_tried(lake: Lake) -> None:
    kmeans, general = compare_studies(lake, "a", "b").results
    assert (kmeans.selector, kmeans.budget, general.selector, general.budget) == (
        "KMeans",
        20,
        "General",
        None,
    )
    assert (kmeans.a, kmeans.b) == (Outcomes(12, 20), Outcomes(20, 20))
    assert (general.a, general.b) == (Outcomes(5, 20), Outcomes(20, 40))  # a's BC_RNN is left out
    assert general.policies == ("BC_MLP",)
    assert general.difference == 0.25
    assert (general.a_interval, general.b_interval) == (wilson_interval(5, 20), wilson_interval(20, 40))
    assert general.interval == rate_difference(Outcomes(20, 40), Outcomes(5, 20)).interval


def test_differences_are_tested_and_adjusted_for_all_rows(lake: Lake) -> None:
    kmeans, general = compare_studies(lake, "a", "b").results
    z = 0.25 / math.sqrt(25 / 60 * 35 / 60 * (1 / 20 + 1 / 40))
    assert (general.z, general.p) == pytest.approx((z, 2 * stats.norm.sf(z)))
    assert kmeans.p_holm == pytest.approx(2 * kmeans.p)
    assert general.p_holm == pytest.approx(general.p)
    assert (kmeans.stars, general.stars) == ("**", "ns")


def test_turned_round_the_differences_change_their_signs(lake: Lake) -> None:
    there = {row.selector: row for row in compare_studies(lake, "a", "b").results}
    back = {row.selector: row for row in compare_studies(lake, "b", "a").results}
    for selector, row in there.items():
        assert (back[selector].z, back[selector].difference) == pytest.approx((-row.z, -row.difference))
        assert back[selector].p_holm == pytest.approx(row.p_holm)


def test_selections_of_only_one_study_are_named(lake: Lake) -> None:
    found = compare_studies(lake, "a", "b")
    assert (found.only_a, found.only_b) == ([("Random", 20)], [("KMeans", 5)])


def test_a_study_does_not_differ_from_itself(lake: Lake) -> None:
    found = compare_studies(lake, "a", "a-k")
    assert (found.a, found.b, found.fields, found.only_a, found.only_b) == ("a-k", "a-k", [], [], [])
    assert [(row.difference, row.p_holm) for row in found.results] == [(0.0, 1.0)] * 3


def test_unseen_targets_are_compared_apart(lake: Lake) -> None:
    for name, successes in (("c", 3), ("d", 4)):
        add_study(lake, name, SETUP, {("KMeans", 20, "BC_MLP", 0): (successes, 8)}, kind="unseen")
    (row,) = compare_studies(lake, "c", "d", kind="unseen").results
    assert (row.a, row.b) == (Outcomes(3, 8), Outcomes(4, 8))
    assert compare_studies(lake, "c", "d").results == []


def test_a_selection_without_a_common_policy_is_not_compared() -> None:
    a, b = {("KMeans", 20): {"BC_MLP": Outcomes(1, 2)}}, {("KMeans", 20): {"BC_RNN": Outcomes(1, 2)}}
    assert rate_differences(a, b) == []


def test_an_unknown_study_is_refused_wherever_it_stands(lake: Lake) -> None:
    for pair in (("a", "zz"), ("zz", "a")):
        with pytest.raises(UnknownNameError, match="unknown study 'zz'"):
            compare_studies(lake, *pair)


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


def test_the_command_shows_setup_results_and_what_only_one_study_has(
    lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [" ".join(line.split()) for line in said(capsys, lake, "a", "b").splitlines()]
    for line in (
        "A a-k",
        "candidates.timing.dt 0.05 0.1",
        "budgets also 5",
        "KMeans 20 60.0 [39,78] 100.0 [84,100] +40.0 [16,61] 3.16 0.0031 **",
        "General all 25.0 [11,47] 50.0 [35,65] +25.0 [-1,45] 1.85 0.064 ns",
        "only in A: Random k=20",
        "only in B: KMeans k=5",
    ):
        assert line in lines


def test_the_command_writes_the_same_as_json_and_markdown(
    lake: Lake, capsys: pytest.CaptureFixture[str]
) -> None:
    found = compare_studies(lake, "a", "b")
    values = json.loads(said(capsys, lake, "a", "b", format="json"))
    assert [row["z"] for row in values["results"]] == [row.z for row in found.results]
    assert values["results"][0]["stars"] == "**"
    assert values["only_b"] == [{"selector": "KMeans", "budget": 5}]
    page = said(capsys, lake, "a", "b", format="markdown")
    assert "| candidates.timing.dt | 0.05 | 0.1 |" in page
    assert "| KMeans | 20 | 60.0 [39,78] | 100.0 [84,100] |" in page
    assert "policies that both tried (BC_MLP)" in page


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
