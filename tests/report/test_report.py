"""The report of a study small enough to compute every table by hand, and the files it is written to."""

from __future__ import annotations

import json
import re
import shlex
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from plancurate.tasks.lake.schema import table
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.report import Report, build_report, markdown, write_report
from plancurate.tasks.report.agreement import agreement_rows
from plancurate.tasks.report.commands import literal
from plancurate.tasks.report.contents import Report as Contents
from plancurate.tasks.report.contents import Section, Table
from plancurate.tasks.report.page import page
from plancurate.tasks.report.rows import AgreementRow, CoverageRow, PlannerRow, SuccessRow
from plancurate.tasks.report.source import Source
from plancurate.tasks.report.tables import quality_table, success_rows
from plancurate.tasks.report.ways import below_random, words
from plancurate.tasks.study.config import load_config

POOL = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "wbr"}
KEPT = {
    ("General", None): [(0, "RRT", 0), (0, "PRM", 1), (1, "PRM", 0), (2, "RRT", 0), (2, "PRM", 0)],
    ("KMeans_Hybrid", 1): [(0, "RRT", 0), (1, "PRM", 0), (2, "RRT", 0)],
    ("KMeans_Hybrid", 2): [(0, "RRT", 0), (0, "PRM", 1), (1, "PRM", 0)],
    ("Random", 2): [(2, "RRT", 0), (2, "PRM", 0)],
}
OUTCOMES = {
    ("General", None): {"BC_MLP": ("S..C", "S..."), "BC_RNN": ("....", "SS..")},
    ("KMeans_Hybrid", 1): {"BC_MLP": ("S...", "S..."), "BC_RNN": ("S...", "S...")},
    ("KMeans_Hybrid", 2): {"BC_MLP": ("SSSR", "SSSR"), "BC_RNN": ("SSSS", "SSS.")},
    ("Random", 2): {"BC_MLP": ("R...", "R..."), "BC_RNN": ("....", "....")},
}
SECONDS = {
    "prepare_s": 0.125, "base_policy_s": 0.0, "rollouts_s": 0.0, "cluster_s": 0.25, "score_s": 0.0,
    "select_s": 0.0005, "selection_time_s": 0.5,
}  # fmt: skip


def trials(
    selector: str, budget: int | None, policy: str, seed: int, outcomes: str, kind: str = "displaced"
) -> pa.Table:
    """One trial a letter, 0, 1, 2, 3 cm away: S settled, R reached only, C collided, . missed."""
    worse = 0.0 if selector == "KMeans_Hybrid" else 0.3
    rows = [
        {
            "evaluation_id": f"{selector}-{budget}-{policy}-{seed}", "selection_id": f"{selector}-{budget}",
            "selector": selector, "budget": budget, "policy": policy, "seed": seed, "n_kept": 4,
            "selection_time_s": 0.5, "train_s": 1.5, "test_id": number, "kind": kind, "target_id": 0,
            "distance_cm": number if kind == "displaced" else None, "x": 0.0, "y": 0.0, "z": 0.0,
            "success": outcome in "SR", "settled": outcome == "S", "reached": outcome in "SR",
            "collided": outcome == "C", "out_of_limits": False, "steps": 10,
            "final_distance": 0.01 * number + worse, "path_length": 1.0, "joint_movement": 2.0 + number,
            "settled_distance": 0.0,
        }
        for number, outcome in enumerate(outcomes)
    ]  # fmt: skip
    return pa.Table.from_pylist(rows, table("evaluations").schema)


def selection(selector: str, budget: int | None) -> pa.Table:
    """A selection of the trajectories in KEPT."""
    rows = [
        {
            "selection_id": f"{selector}-{budget}", "seed": 0, "pool_hash": "feed", "n_targets": 3,
            "params": "{}", "trajectory_id": f"t{target:04d}-{planner}-r0-0a1b2c", "target_id": target,
            "planner": planner, "goal_index": goal, "n_pool": 16, "budget": budget, **SECONDS,
            "steps": [0] if selector == "Random" else None,
        }
        for target, planner, goal in KEPT[selector, budget]
    ]  # fmt: skip
    return pa.Table.from_pylist(rows, table("selections").schema)


@pytest.fixture
def lake(small_lake: Lake) -> Lake:
    """Four selections, two policies, two seeds, four tests a network, and two fresh targets for General."""
    config = load_config("smoke", None, {"planners": ("RRT", "PRM"), "n_targets": 3, "seeds": (0, 1)})
    study = {
        "study_key": "aaa", "config": config.model_dump_json(), **POOL, "package_version": "0",
        "created_at": datetime(2026, 1, 2, tzinfo=UTC), "ompl_version": "1.5.2",
    }  # fmt: skip
    small_lake.write(
        "studies", {"study": "tiny"}, "aaa", pa.Table.from_pylist([study], table("studies").schema), {}
    )
    parts = [
        trials(*chosen, policy, seed, outcomes)
        for chosen, by_policy in OUTCOMES.items()
        for policy, by_seed in by_policy.items()
        for seed, outcomes in enumerate(by_seed)
    ]
    parts.append(trials("General", None, "BC_MLP", 0, "S.", kind="unseen"))
    for number, rows in enumerate(parts):
        small_lake.write("evaluations", {**POOL, "study": "tiny-aaa"}, f"e{number}", rows, {})
    for selector, budget in KEPT:
        rows = selection(selector, budget)
        small_lake.write("selections", {**POOL, "selector": selector}, f"{selector}-{budget}", rows, {})
    return small_lake


@pytest.fixture
def report(lake: Lake) -> Report:
    return build_report(lake, "tiny")


def found(report: Report, key: str) -> Table[Any]:
    return next(table for table in report.tables if table.key == key)


def cells(report: Report, key: str) -> dict[tuple[str, str], list[str]]:
    """Cells of a table by selector and budget."""
    return {(line[0], line[1]): list(line[2:]) for line in found(report, key).cells}


def test_success_is_counted_over_policies_and_seeds_and_tested_against_general(lake: Lake) -> None:
    rows: dict[Any, SuccessRow] = {
        (row.selector, row.budget): row for row in success_rows(Source(lake, "tiny"))
    }
    assert [(key, row.successes, row.n) for key, row in rows.items()] == [
        (("KMeans_Hybrid", 2), 15, 16),
        (("General", None), 4, 16),
        (("KMeans_Hybrid", 1), 4, 16),
        (("Random", 2), 2, 16),
    ]
    best = rows["KMeans_Hybrid", 2]
    # Wilson, n = 16, 15 successes, z = 1.95996: centre 0.8527, half-width 0.1361
    assert (best.wilson.low, best.wilson.high) == pytest.approx((0.7167, 0.9889), abs=1e-4)
    assert best.settled_rate == 13 / 16
    assert best.published == 253 / 320
    assert best.against_general is not None
    assert rows["Random", 2].against_general is not None
    # z = (15/16 - 4/16) / sqrt(19/32 * 13/32 * 2/16); Holm: 3 tests, this p the smallest, Random's the second
    assert best.against_general.statistic == pytest.approx(3.9593, abs=1e-4)
    assert best.against_general.p == pytest.approx(7.517e-5, rel=1e-3)
    assert best.against_general.holm_p == pytest.approx(3 * best.against_general.p)
    assert best.against_general.stars == "***"
    assert rows["Random", 2].against_general.statistic == pytest.approx(-0.9058, abs=1e-4)
    assert rows["Random", 2].against_general.holm_p == pytest.approx(2 * rows["Random", 2].against_general.p)
    assert rows["Random", 2].published is None
    assert rows["General", None].against_general is None


def test_networks_are_drawn_again_within_their_policy(lake: Lake) -> None:
    rows = {(row.selector, row.budget): row for row in success_rows(Source(lake, "tiny"))}
    same = rows["KMeans_Hybrid", 1].networks
    spread = rows["KMeans_Hybrid", 2].networks
    assert same is not None
    assert spread is not None
    assert (same.low, same.high) == (0.25, 0.25)  # every network succeeds in one test of four
    assert (spread.low, spread.high) == (14 / 16, 1.0)  # 8 of 8 and twice 3, 3 and 4 or 4 of 4
    (fresh,) = success_rows(Source(lake, "tiny", "unseen"))
    assert fresh.networks is None  # one network shows nothing of how networks vary


def test_table_a1_shows_its_rows_in_percent(report: Report) -> None:
    assert found(report, "table_a1").headers[:6] == (
        "selector",
        "k",
        "n",
        "success",
        "success %",
        "published %",
    )
    lines = cells(report, "table_a1")
    assert lines["KMeans_Hybrid", "2"] == [
        "16", "15", "93.8", "79.1", "[71.7, 98.9]", "[87.5, 100.0]", "***", "3.96", "< 0.001", "< 0.001", "81.2",
    ]  # fmt: skip
    assert lines["General", "all"][3:] == ["54.1", "[10.2, 49.5]", "[12.5, 37.5]", "", "", "", "", "25.0"]
    assert lines["Random", "2"][3] == "\N{EN DASH}"


def test_table_a2_has_a_column_for_each_policy(report: Report) -> None:
    assert found(report, "table_a2").headers == ("selector", "k", "BC_MLP", "BC_RNN")
    lines = cells(report, "table_a2")
    assert lines["General", "all"] == ["25.0 (56.2)", "25.0 (82.5)"]
    # z = (8/8 - 2/8) / sqrt(10/16 * 6/16 * 2/8) = 3.10 and (7/8 - 2/8) / sqrt(9/16 * 7/16 * 2/8) = 2.52
    assert lines["KMeans_Hybrid", "2"] == ["100.0 ** (73.8)", "87.5 * (92.5)"]
    assert lines["Random", "2"] == ["25.0 ns", "0.0 ns"]


def test_table_a3_has_a_column_for_each_distance(report: Report) -> None:
    assert found(report, "table_a3").headers == ("selector", "k", "0 cm", "1 cm", "2 cm", "3 cm")
    lines = cells(report, "table_a3")
    assert lines["General", "all"] == ["75.0 (45.0)", "25.0 (51.7)", "0.0 (53.3)", "0.0 (50.0)"]
    assert lines["KMeans_Hybrid", "2"] == ["100.0 (90.0)", "100.0 (88.3)", "100.0 (81.7)", "75.0 (73.3)"]
    assert lines["Random", "2"] == ["50.0", "0.0", "0.0", "0.0"]


def test_table_a4_has_means_with_t_intervals_and_welch_stars(lake: Lake, report: Report) -> None:
    row = next(row for row in quality_table(Source(lake, "tiny")).rows if row.budget == 2)
    # 4 times 0, 1, 2, 3 cm: mean 1.5 cm, deviation sqrt(20 / 15) cm; t(15) = 2.1314
    half = 2.13145 * (20 / 15) ** 0.5 / 4 / 100
    assert row.final_distance.value == pytest.approx(0.015)
    interval = row.final_distance.interval
    assert (interval.low, interval.high) == pytest.approx((0.015 - half, 0.015 + half), abs=1e-6)
    assert row.final_distance.against_general is not None
    assert row.final_distance.against_general.statistic == pytest.approx(
        -73.485, abs=1e-2
    )  # -30 cm / 0.408 cm
    lines = cells(report, "table_a4")
    assert lines["KMeans_Hybrid", "2"] == [
        "0.015 [0.009, 0.021] ***", "0.103", "1.000 [1.000, 1.000] ns", "2.003", "3.500 [2.885, 4.115] ns", "2.356",
    ]  # fmt: skip
    assert lines["General", "all"][0] == "0.315 [0.309, 0.321]"


def test_table_a5_has_seconds_by_stage(report: Report) -> None:
    assert cells(report, "table_a5")["KMeans_Hybrid", "1"] == [
        "0.125", "0", "0", "0.25", "0", "< 0.001", "0.5", "1.07",
    ]  # fmt: skip


def test_coverage_counts_targets_left_out_and_steps_learnt_from(report: Report, lake: Lake) -> None:
    rows: dict[Any, CoverageRow] = {(row.selector, row.budget): row for row in found(report, "coverage").rows}
    assert rows["KMeans_Hybrid", 2] == CoverageRow(
        "KMeans_Hybrid", 2, 3, 16, 3, 1, 0, 1.0, 2, 3, 2, 3, 2 / 3, 1.0
    )
    assert rows["General", None] == CoverageRow("General", None, 5, 16, 3, 0, 1, 2.0, 2, 5, 2, 4, 0.8, 1.0)
    waypoints = lake.sql(
        "SELECT sum(n_waypoints) FROM trajectories WHERE target_id = 2 AND run = 0"
    ).to_pydict()
    share = 2 / float(next(iter(waypoints.values()))[0])
    assert rows["Random", 2].share_of_steps == pytest.approx(share)
    assert cells(report, "coverage")["Random", "2"] == [
        "2", "16", "0", "0", "2", "2 of 3", "2", "2 of 2", "1", "100.0", f"{100 * share:.1f}",
    ]  # fmt: skip


def test_planners_are_shown_by_their_share_of_each_selection(report: Report) -> None:
    shown = found(report, "planners")
    assert shown.headers == ("planner", "KMeans_Hybrid k=2", "General", "KMeans_Hybrid k=1", "Random k=2")
    assert list(shown.cells) == [
        ["PRM", "66.7", "60.0", "33.3", "50.0"],
        ["RRT", "33.3", "40.0", "66.7", "50.0"],
    ]
    assert PlannerRow("General", None, "RRT", 2, 0.4) in shown.rows


def test_fresh_targets_have_a_table_of_their_own(report: Report) -> None:
    (line,) = found(report, "unseen").cells
    assert line[:5] == ["General", "all", "2", "1", "50.0"]
    assert line[5] == "\N{EN DASH}"  # the publication has no such tests


def test_agreement_says_sign_significance_and_size(lake: Lake, report: Report) -> None:
    best, one = agreement_rows(Source(lake, "tiny"))
    assert isinstance(best, AgreementRow)
    assert (best.selector, best.budget, best.gain) == ("KMeans_Hybrid", 2, 11 / 16)
    assert (best.published_gain, best.published_stars) == (80 / 320, "***")
    assert best.difference == pytest.approx(0.4375)
    assert best.verdict == "better than General in both; 43.8 points higher here, beyond chance"
    assert (
        one.verdict
        == "better than General in the publication, no sure effect here; the sizes agree within chance"
    )
    assert "1 of 1 selectors have the published sign" in report.summary[1]


def test_the_best_selections_are_named_first(report: Report) -> None:
    assert report.summary[0] == (
        "Best: KMeans_Hybrid k=2 with 93.8 % [71.7, 98.9] of 16 tests successful. "
        "General, which keeps every candidate: 25.0 % [10.2, 49.5]."
    )


def test_figures_show_the_largest_budget_and_curves_by_budget(report: Report) -> None:
    pictures = {figure.key: figure for figure in report.figures}
    assert list(pictures) == [
        "figure_2", "figure_a1", "figure_budgets", "figure_4", "figure_5", "figure_3", "figure_a2", "figure_a3",
        "figure_ways",
    ]  # fmt: skip
    labels = {node.text for node in ET.fromstring(pictures["figure_2"].pictures[0][1].svg()).iter()}
    assert {"KMeans_Hybrid", "General", "Random", "93.8", "***"} <= labels
    assert len(pictures["figure_2"].note) > 0
    assert [caption for caption, _ in pictures["figure_budgets"].pictures] == ["KMeans_Hybrid"]
    assert len(pictures["figure_3"].pictures) == 3


def test_the_setup_names_all_that_a_repetition_needs(report: Report) -> None:
    setup = report.setup
    assert (setup["study"], setup["pool"], setup["pool_hash"]) == ("tiny-aaa", "0a1b2c", "feed")
    assert setup["seeds"] == {"targets_and_planners": 0, "selectors": 0, "training": [0, 1], "tests": 1000}
    # 18 runs of 10, 20 and 30 ms; 4 selections of 0.5 s, 16 networks of 1.5 s
    assert setup["seconds_of_work"] == pytest.approx(
        {"plan_s": 0.18, "timing_s": 0.36, "verify_s": 0.54, "selection_s": 2.0, "train_s": 24.0}
    )
    assert {"plancurate", "ompl", "python", "torch", "prefect", "mlflow", "duckdb"} <= set(
        setup["versions_of_this_report"]
    )


def test_every_command_gives_the_rows_of_its_query(lake: Lake, report: Report) -> None:
    for shown in report.tables:
        assert shown.queries
        for query in shown.queries:
            program, command, statement = shlex.split(query.command)
            assert (program, command) == ("plancurate", "sql")
            assert statement == query.statement
            again, rows = lake.sql(statement).to_pylist(), query.rows(lake)
            assert len(again) == len(rows) > 0
            for one, other in zip(again, rows, strict=True):
                assert one == pytest.approx(other)


def test_values_are_written_as_sql_literals() -> None:
    assert literal(None) == "NULL"
    assert literal(True) == "true"
    assert literal(["it's", 2, 0.5]) == "['it''s', 2, 0.5]"


class Checker(HTMLParser):
    """Collects what a page opens, and fails where it closes something else."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.links += [value for name, value in attrs if name in ("href", "src", "srcset", "data") and value]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """A shape of a picture: opens nothing."""

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def checked(text: str) -> Checker:
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    assert len(set(checker.ids)) == len(checker.ids)
    return checker


def test_the_page_holds_everything_and_loads_nothing(report: Report) -> None:
    text = page(report)
    checker = checked(text)
    assert {table.key for table in report.tables} | {figure.key for figure in report.figures} <= set(
        checker.ids
    )
    assert {link[1:] for link in checker.links} <= set(
        checker.ids
    )  # links to places of the page, nothing else
    for loaded in ("<script", "@import", "url(", "<link", "<img", "<iframe"):
        assert loaded not in text
    pictures = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(pictures) == sum(len(figure.pictures) for figure in report.figures)
    for picture in pictures:
        assert ET.fromstring(picture).get("aria-label")


def test_text_is_escaped_on_the_page() -> None:
    table = Table("t", "<b>&", "<i>", [], ["<u>"], [["<script>", '"&']], [])
    text = page(Contents("<x>", ["<y>"], [Section("s", "<z>", "<p>", tables=[table])], {"<k>": {"a": "<v>"}}))
    checked(text)
    for tag in ("<script", "<b>", "<i>", "<u>", "<x>", "<y>", "<z>", "<k>", "<v>"):
        assert tag not in text


def test_page_markdown_and_json_are_written_with_the_same_tables(report: Report, tmp_path: Path) -> None:
    written = write_report(report, tmp_path / "tiny")
    assert written == tmp_path / "tiny" / "index.html"
    record = json.loads((tmp_path / "tiny" / "report.json").read_text(), parse_constant=pytest.fail)
    assert [shown["key"] for shown in record["tables"]] == [shown.key for shown in report.tables]
    assert record["tables"][0]["rows"][0]["successes"] == 15
    text = (tmp_path / "tiny" / "report.md").read_text()
    for shown in report.tables:
        assert f"### {shown.title}" in text
        assert all(query.command in text for query in shown.queries)
    for link in re.findall(r"!\[[^]]*\]\(([^)]*)\)", text):
        ET.parse(tmp_path / "tiny" / link)
    assert "![" not in markdown(report, figures=False)
    again = load_config("quick", tmp_path / "tiny" / "config.yaml", {})
    assert again.model_dump(mode="json") == report.setup["configuration"]


def test_a_study_without_general_is_compared_with_nothing(small_lake: Lake) -> None:
    rows = trials("Random", 2, "BC_MLP", 0, "S...")
    small_lake.write("evaluations", {**POOL, "study": "alone"}, "e0", rows, {})
    small_lake.write("selections", {**POOL, "selector": "Random"}, "Random-2", selection("Random", 2), {})
    report = build_report(small_lake, "alone")
    assert "agreement" not in [shown.key for shown in report.tables]
    assert report.tables[0].cells[0][8:12] == ["", "", "", ""]
    assert report.setup["configuration"] == {}
    checked(page(report))


def test_reasons_name_what_a_selection_lacks_against_a_random_one() -> None:
    random = CoverageRow("Random", 2, 6, 16, 3, 0, 2, 2.0, 2, 6, 2, 5, 0.7, 1.0)
    same = replace(random, selector="CUPID")
    assert words(same, random) == "not explained by coverage or by the way"
    fewer = words(replace(same, targets_without=1, shortest_way=0.5), random)
    assert fewer.startswith("leaves 1 of 3 targets without data; keeps more trajectories that go a long way")


def test_published_selectors_below_random_are_listed_with_their_reasons(lake: Lake) -> None:
    rows = trials("SCIZOR", 2, "BC_MLP", 0, "....")
    lake.write("evaluations", {**POOL, "study": "tiny-aaa"}, "scizor", rows, {})
    chosen = selection("Random", 2).to_pylist()
    kept = [{**row, "selection_id": "SCIZOR-2"} for row in chosen]
    lake.write(
        "selections",
        {**POOL, "selector": "SCIZOR"},
        "s",
        pa.Table.from_pylist(kept, table("selections").schema),
        {},
    )
    (row,) = below_random(Source(lake, "tiny"))
    assert (row.selector, row.budget, row.rate, row.random_rate) == ("SCIZOR", 2, 0.0, 2 / 16)
    assert row.words == "not explained by coverage or by the way"
    page_text = page(build_report(lake, "tiny"))
    assert "Published selectors below Random" in page_text
