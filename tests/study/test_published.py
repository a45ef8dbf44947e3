"""The publication's printed tables against each other and against our statistics."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from importlib.resources import files
from typing import Any

import pytest
import yaml

from plancurate.tasks.learning.policies import policy_names
from plancurate.tasks.study.published import PublishedResult, published_for, published_results
from plancurate.tasks.study.statistics import Interval, Outcomes, two_proportion_test, wilson_interval

# Successes of 320 trials in A1, and what the six counts of A3 add up to.
SUCCESSES = {
    "KMeans_Hybrid": (253, 253),
    "Hierarchical_Hybrid": (251, 251),
    "DBSCAN": (247, 246),
    "Hierarchical": (245, 247),
    "DBSCAN_Hybrid": (245, 221),
    "KMeans": (238, 237),
    "SCIZOR": (181, 173),
    "General": (173, 170),
    "RuleBased_General": (128, 125),
    "BehaviorRetrieval": (118, 118),
    "CUPID": (14, 14),
}
GENERAL = published_results()["General"]


def printed(selector: str) -> dict[str, Any]:
    """A selector's percentages as they are in the file."""
    text = files("plancurate.tasks.study").joinpath("published.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text)["selectors"][selector])


def total(outcomes: list[Outcomes]) -> Outcomes:
    """All trials together."""
    return Outcomes(sum(part.successes for part in outcomes), sum(part.n for part in outcomes))


def test_all_eleven_selectors_are_there_best_first() -> None:
    assert list(published_results()) == list(SUCCESSES)
    rates = [result.success.rate for result in published_results().values()]
    assert rates == sorted(rates, reverse=True)


@pytest.mark.parametrize("result", published_results().values(), ids=published_results())
def test_every_count_gives_its_printed_percentage_back(result: PublishedResult) -> None:
    row = printed(result.selector)
    by_policy, by_distance = list(result.by_policy.values()), list(result.by_distance.values())
    outcomes = [result.success, *by_policy, *by_distance]
    percents = [row["success"], *row["by_policy"], *row["by_distance"]]
    assert [100 * outcome.rate for outcome in outcomes] == pytest.approx(percents, abs=0.05 + 1e-9)
    assert [outcome.n for outcome in outcomes] == [320, *[80] * 4, 20, *[60] * 5]


@pytest.mark.parametrize("result", published_results().values(), ids=published_results())
def test_totals_by_policy_agree_with_the_table_of_totals(result: PublishedResult) -> None:
    assert result.success == Outcomes(SUCCESSES[result.selector][0], 320)
    assert total(list(result.by_policy.values())) == result.success


@pytest.mark.parametrize("result", published_results().values(), ids=published_results())
def test_totals_by_distance_agree_or_differ_as_they_do_in_print(result: PublishedResult) -> None:
    assert total(list(result.by_distance.values())) == Outcomes(SUCCESSES[result.selector][1], 320)


def test_four_selectors_of_eleven_agree_by_distance() -> None:
    differences = {name: by_distance - all_ for name, (all_, by_distance) in SUCCESSES.items()}
    assert {name: d for name, d in differences.items() if d} == {
        "DBSCAN": -1, "Hierarchical": 2, "DBSCAN_Hybrid": -24, "KMeans": -1, "SCIZOR": -8, "General": -3,
        "RuleBased_General": -3,
    }  # fmt: skip


# Wilson's interval and the pooled z by their formulas, done apart from this project.
@pytest.mark.parametrize(
    ("selector", "low", "high", "z", "stars"),
    [
        ("KMeans_Hybrid", 0.7427, 0.8316, 6.7030, "***"),
        ("Hierarchical_Hybrid", 0.7361, 0.8259, 6.5204, "***"),
        ("DBSCAN", 0.7228, 0.8145, 6.1587, "***"),
        ("Hierarchical", 0.7162, 0.8087, 5.9794, "***"),
        ("DBSCAN_Hybrid", 0.7162, 0.8087, 5.9794, "***"),
        ("KMeans", 0.6932, 0.7885, 5.3600, "***"),
        ("SCIZOR", 0.5109, 0.6188, 0.6361, "ns"),
        ("General", 0.4859, 0.5944, 0.0, "ns"),
        ("RuleBased_General", 0.3478, 0.4546, -3.5638, "***"),
        ("BehaviorRetrieval", 0.3177, 0.4229, -4.3661, "***"),
        ("CUPID", 0.0262, 0.0721, -13.8203, "***"),
    ],
)
def test_intervals_and_stars_of_the_published_counts(
    selector: str, low: float, high: float, z: float, stars: str
) -> None:
    success, base = published_results()[selector].success, GENERAL.success
    interval = wilson_interval(success.successes, success.n)
    test = two_proportion_test(success, base)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=1e-4)
    assert (test.statistic, test.stars) == (pytest.approx(z, abs=1e-4), stars)


def test_quality_and_time_have_their_units_and_gaps() -> None:
    hybrid, cupid = published_results()["KMeans_Hybrid"], published_results()["CUPID"]
    assert (hybrid.final_distance, hybrid.path_length, hybrid.joint_movement) == (0.103, 2.003, 2.356)
    assert (GENERAL.final_distance, GENERAL.path_length, GENERAL.joint_movement) == (0.322, 24.7, 54.967)
    assert (cupid.selection_time_s, hybrid.selection_time_s) == (1012.19, 1.07)
    at_once = [name for name, result in published_results().items() if result.selection_time_s == 0]
    assert at_once == ["General", "RuleBased_General"]
    assert {result.selection_times for result in published_results().values()} == {18}
    assert cupid.selection_time_interval == Interval(793, 1232)
    assert hybrid.selection_time_interval is None


def test_policies_have_the_names_of_ours() -> None:
    assert all(set(result.by_policy) == set(policy_names()) for result in published_results().values())


def test_nobody_changes_what_was_printed() -> None:
    with pytest.raises(FrozenInstanceError):
        GENERAL.final_distance = 0.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        GENERAL.by_policy["BC_MLP"] = Outcomes(80, 80)  # type: ignore[index]


def test_parameters_do_not_hide_what_the_publication_says_of_a_selector() -> None:
    named = published_for(["KMeans_Hybrid(scaling=raw)", "General", "Random"])
    assert named == {
        "KMeans_Hybrid(scaling=raw)": published_results()["KMeans_Hybrid"],
        "General": GENERAL,
    }
