"""The report of a study small enough to compute every table by hand, and the files it is written to."""

from __future__ import annotations

import json
import re
import shlex
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from plancurate.flows.cli.pools import say_unsteady
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.report import Report, build_report, markdown, write_report
from plancurate.tasks.report.charts import broken
from plancurate.tasks.report.commands import literal
from plancurate.tasks.report.contents import Report as Contents
from plancurate.tasks.report.contents import Section, Table
from plancurate.tasks.report.page import page
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.results import StudyResults, study_results
from plancurate.tasks.study.selection_results import reasons
from plancurate.tasks.study.selection_rows import BelowRandomRow, CoverageRow, PlannerRow
from plancurate.tasks.study.text import percents

from ..lakes import copied
from ..studies import StudyMaker

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}
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
SECONDS = {"prepare_s": 0.125, "cluster_s": 0.25, "select_s": 0.0005, "selection_time_s": 0.5}


def made_study(maker: StudyMaker) -> str:
    """Four selections, two policies, two seeds, four tests a network."""
    config = load_config("smoke", None, {"planners": ("RRT", "PRM"), "n_targets": 3, "seeds": (0, 1)})
    study = maker.record("tiny", "aaaaaaaa", config=config.model_dump_json())
    for (selector, budget), by_policy in OUTCOMES.items():
        steps = {"steps": [0]} if selector == "Random" else {}
        maker.select(study, selector, budget, KEPT[selector, budget], **SECONDS, **steps)
        for policy, by_seed in by_policy.items():
            for seed, outcomes in enumerate(by_seed):
                maker.test(study, selector, budget, policy, outcomes, seed=seed)
    return study


@pytest.fixture(scope="module")
def lake(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake with the study, for tests that only read."""
    lake = copied(small_lake_once, tmp_path_factory.mktemp("report"))
    made_study(StudyMaker(lake))
    return lake


@pytest.fixture(scope="module")
def results(lake: Lake) -> StudyResults:
    return study_results(lake, "tiny-aaaaaaaa")


@pytest.fixture
def study(maker: StudyMaker) -> str:
    """The study in a lake to write into."""
    return made_study(maker)


@pytest.fixture(scope="module")
def report(results: StudyResults) -> Report:
    return build_report(results)


def shown(report: Report, key: str) -> Table[Any]:
    return next(table for table in report.tables if table.key == key)


def cells(report: Report, key: str) -> dict[tuple[str, str], list[str]]:
    """Cells of a table by selector and budget."""
    return {(line[0], line[1]): list(line[2:]) for line in shown(report, key).cells}


@pytest.mark.slow
def test_table_a1_shows_rates_gains_ties_and_the_publications_test_beside(
    report: Report, results: StudyResults
) -> None:
    table = shown(report, "table_a1")
    assert table.headers == (
        "selector", "k", "n", "success %", "published %", "95 %",
        "selection seeds x training seeds x targets", "", "gain", "95 %", "Holm p", "settled %",
        "95 %", "hard %", "n", "publication's: Wilson 95 %", "z", "p",
    )  # fmt: skip
    best = results.headline.summaries[0]
    assert best.gain is not None
    lines = cells(report, "table_a1")
    assert lines["KMeans_Hybrid", "2"] == [
        "16", "93.8", "79.1", percents(best.interval), "1 x 2 x 4", "best",
        f"+68.8 {best.gain.stars}", percents(best.gain.interval), f"{best.gain.holm_p:.3f}", "81.2",
        percents(best.settled_interval), "\N{EN DASH}", "0", "[71.7, 98.9]", "3.96", "< 0.001 ***",
    ]  # fmt: skip
    assert lines["General", "all"][5:9] == ["tie", "", "", ""]  # four targets tell little apart
    assert lines["Random", "2"][2] == "\N{EN DASH}"


@pytest.mark.slow
def test_verified_rollouts_are_a_column_where_a_study_has_some(
    small_lake: Lake, maker: StudyMaker, study: str
) -> None:
    maker.refer(study, Planner="SSSs", Replay="S.sh", StraightLine="SShh")
    for policy, verdicts in (("BC_MLP", "PF.."), ("BC_RNN", "PP..")):
        maker.judge(study, "KMeans_Hybrid", 2, policy, verdicts)
    table = shown(build_report(study_results(small_lake, study)), "table_a1")
    place = table.headers.index("motions %")
    assert {len(line) for line in table.cells} == {len(table.headers)}
    assert {line[0]: tuple(line[place : place + 2]) for line in table.cells} == {
        "KMeans_Hybrid": ("\N{EN DASH}", "0"),  # the last line of that name, k = 1
        "General": ("\N{EN DASH}", "0"),
        "Random": ("\N{EN DASH}", "0"),
        "Planner": ("", ""),
        "Replay": ("", ""),
        "StraightLine": ("", ""),
    }
    assert table.cells[0][:2] == ["KMeans_Hybrid", "2"]
    assert table.cells[0][place : place + 2] == ["75.0", "4"]
    assert "the robot may run" in table.note


@pytest.mark.slow
def test_references_stand_below_the_selections_in_the_table_and_beside_them_in_its_record(
    small_lake: Lake, maker: StudyMaker, study: str
) -> None:
    maker.refer(study, Planner="SSSs", Replay="S.sh", StraightLine="SShh")
    table = shown(build_report(study_results(small_lake, study)), "table_a1")
    assert len(table.cells) == len(table.rows) + 3
    assert {len(line) for line in table.cells} == {len(table.headers)}
    assert list(table.cells[-2]) == [
        "Replay", "\N{EN DASH}", "4", "50.0", "", "[15.0, 85.0]", "4 targets", "reference", "", "", "",
        "50.0", "[15.0, 85.0]", "50.0", "2", "[15.0, 85.0]", "", "",
    ]  # fmt: skip
    assert [line[0] for line in table.cells[-3:]] == ["Planner", "Replay", "StraightLine"]
    record = table.record()
    assert [row["reference"] for row in record["references"]] == ["Planner", "Replay", "StraightLine"]
    assert (record["references"][2]["successes"], record["references"][2]["hard_n"]) == (2, 2)
    assert all("reference" not in row for row in record["rows"])
    assert any("GROUPING SETS" in command for command in record["commands"])


def test_table_a2_has_a_column_for_each_policy(report: Report) -> None:
    assert shown(report, "table_a2").headers == ("selector", "k", "BC_MLP", "BC_RNN")
    lines = cells(report, "table_a2")
    assert lines["General", "all"] == ["25.0 (56.2)", "25.0 (82.5)"]
    assert lines["KMeans_Hybrid", "2"] == ["100.0 ns (73.8)", "87.5 ns (92.5)"]
    assert lines["Random", "2"] == ["25.0 ns", "0.0 ns"]


def test_table_a3_has_a_column_for_each_distance_with_stars_and_p(report: Report) -> None:
    table = shown(report, "table_a3")
    assert table.headers == ("selector", "k", "0 cm", "1 cm", "2 cm", "3 cm")
    lines = cells(report, "table_a3")
    assert lines["General", "all"] == ["75.0 (45.0)", "25.0 (51.7)", "0.0 (53.3)", "0.0 (50.0)"]
    assert lines["KMeans_Hybrid", "2"] == [
        "100.0 ns (90.0)", "100.0 ns (88.3)", "100.0 ns (81.7)", "75.0 ns (73.3)",
    ]  # fmt: skip
    assert lines["Random", "2"] == ["50.0 ns", "0.0 ns", "0.0 ns", "0.0 ns"]
    gains = [row["gain"] for row in table.record()["rows"] if row["selector"] == "Random"]
    # z = (2/4 - 3/4) / sqrt(5/8 * 3/8 * 2/4), the publication's test of Random at 0 cm
    assert gains[0]["z_test"]["statistic"] == pytest.approx(-0.7303, abs=1e-4)
    assert all(0 < gain["p"] <= gain["holm_p"] <= 1 for gain in gains)


@pytest.mark.slow
def test_failures_show_each_kind_with_its_commonest_detail(small_lake: Lake, maker: Any) -> None:
    study = maker.record("failing", "aaaaaaaa")
    maker.test(study, "General", None, "BC_MLP", "SSCCL...")
    maker.test(study, "General", None, "BC_MLP", "C", seed=1, failure_detail="link_4 and ground")
    maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", "SR")
    report = build_report(study_results(small_lake, study))
    lines = cells(report, "failures")
    assert lines["General", "all"] == [
        "9", "77.8", "33.3", "link_4 and table", "11.1", "joint_2 velocity", "33.3",
    ]  # fmt: skip
    assert lines["KMeans_Hybrid", "2"] == ["2", "0.0", "0.0", "\N{EN DASH}", "0.0", "\N{EN DASH}", "0.0"]


@pytest.mark.slow
def test_table_a4_has_means_with_t_intervals_and_welch_stars(small_lake: Lake, maker: Any) -> None:
    study = maker.record("far", "aaaaaaaa")
    maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", "SSSS")
    for number in range(2):
        maker.test(study, "General", None, "BC_MLP", "....", seed=number, final_distance=0.3 + number / 100)
    results = study_results(small_lake, study)
    row = next(row for row in results.headline.quality if row.budget == 2)
    # 0, 1, 2, 3 cm: mean 1.5 cm, deviation sqrt(5 / 3) cm; t(3) = 3.1824
    half = 3.18245 * (5 / 3) ** 0.5 / 2 / 100
    assert row.final_distance.value == pytest.approx(0.015)
    interval = row.final_distance.interval
    assert (interval.low, interval.high) == pytest.approx((0.015 - half, 0.015 + half), abs=1e-6)
    # (1.5 - 30.5) cm over sqrt(5/3/4 + 2/7/8) cm: eight values, four of 30 and four of 31
    assert row.final_distance.welch_test is not None
    assert row.final_distance.welch_test.statistic == pytest.approx(-29 / (5 / 12 + 2 / 7 / 8) ** 0.5)
    lines = cells(build_report(results), "table_a4")
    assert lines["KMeans_Hybrid", "2"] == [
        "0.015 [-0.006, 0.036] ***", "0.103", "0.030 [-0.011, 0.071] ns", "1.000 [1.000, 1.000] ns", "2.003",
        "3.500 [1.446, 5.554] ns", "2.356",
    ]  # fmt: skip


def test_table_a5_has_seconds_by_stage_and_the_publications(report: Report) -> None:
    lines = cells(report, "table_a5")
    none = "\N{EN DASH}"
    assert lines["KMeans_Hybrid", "1"] == [
        "1", "0.125", "0", "0", "0.25", "0", "< 0.001", "0.5", none, "1.07", "18", none,
    ]  # fmt: skip
    assert lines["General", "all"][-3:] == ["0", "18", none]


def test_coverage_counts_targets_left_out_and_steps_learnt_from(report: Report, lake: Lake) -> None:
    rows: dict[Any, CoverageRow] = {(row.selector, row.budget): row for row in shown(report, "coverage").rows}
    assert rows["KMeans_Hybrid", 2] == CoverageRow(
        "free", "", "KMeans_Hybrid", 2, 1, 3, 16, 3, 1, 0, 1.0, 2, 3, 2, 3, 2 / 3, 1.0
    )
    assert rows["General", None] == CoverageRow(
        "free", "", "General", None, 1, 5, 16, 3, 0, 1, 2.0, 2, 5, 2, 4, 0.8, 1.0
    )
    waypoints = lake.sql(
        "SELECT sum(n_waypoints) FROM trajectories WHERE target_id = 2 AND run = 0"
    ).to_pydict()
    share = 2 / float(next(iter(waypoints.values()))[0])
    assert rows["Random", 2].share_of_steps == pytest.approx(share)
    assert cells(report, "coverage")["Random", "2"] == [
        "2", "16", "0", "0", "2", "2 of 3", "2", "2 of 2", "1", "100.0", f"{100 * share:.1f}",
    ]  # fmt: skip


def test_planners_are_shown_by_their_share_of_each_selection(report: Report) -> None:
    table = shown(report, "planners")
    assert table.headers == ("planner", "KMeans_Hybrid k=2", "General", "KMeans_Hybrid k=1", "Random k=2")
    assert list(table.cells) == [
        ["PRM", "66.7", "60.0", "33.3", "50.0"],
        ["RRT", "33.3", "40.0", "66.7", "50.0"],
    ]
    assert PlannerRow("free", "", "General", None, "RRT", 2, 0.4) in table.rows


@pytest.mark.slow
def test_fresh_targets_come_first_where_a_study_has_some(small_lake: Lake, maker: Any, study: str) -> None:
    maker.test(study, "General", None, "BC_MLP", "S.", kind="unseen")
    report = build_report(study_results(small_lake, study))
    assert [section.key for section in report.sections][:2] == ["fresh", "success"]
    (line,) = shown(report, "unseen").cells
    assert line[:4] == ["General", "all", "2", "50.0"]
    assert "published %" not in shown(report, "unseen").headers
    assert "tests at targets that no policy was trained on" in report.verdict[0]
    checked(page(report))


@pytest.mark.slow
def test_agreement_says_sign_significance_and_size(small_lake: Lake, maker: Any) -> None:
    study = maker.record("clear", "aaaaaaaa")
    for selector, budget, outcomes in (
        ("General", None, 10 * "S" + 30 * "."),
        ("KMeans_Hybrid", 2, 38 * "S" + 2 * "."),
        ("CUPID", 2, 11 * "S" + 29 * "."),
    ):
        maker.test(study, selector, budget, "BC_MLP", outcomes)
        maker.select(study, selector, budget, [(0, "RRT", 0)])
    results = study_results(small_lake, study)
    best, cupid = results.headline.agreement
    assert (best.selector, best.budget, best.gain, best.published_gain) == ("KMeans_Hybrid", 2, 0.7, 80 / 320)
    assert best.difference == pytest.approx(0.45)
    assert best.verdict == "better than General in both; 45.0 points higher here, beyond chance"
    assert cupid.verdict == (
        "worse than General in the publication, no sure effect here; 52.2 points higher here, beyond chance"
    )
    report = build_report(results)
    (section,) = (section for section in report.sections if section.key == "publication")
    assert "1 of 2 selectors have the published sign of their gain over General, 1 with" in section.text
    assert report.verdict[0].startswith("KMeans_Hybrid k=2 is the best selection: 95.0 %")
    assert "+70.0 points" in report.verdict[1]
    assert "more than chance" in report.verdict[1]


def test_figures_show_the_leader_s_budget_and_curves_by_budget(report: Report) -> None:
    pictures = {figure.key: figure for figure in report.figures}
    assert list(pictures) == [
        "figure_2", "figure_a1", "figure_budgets", "figure_4", "figure_5", "figure_3", "figure_a2", "figure_a3",
        "figure_ways",
    ]  # fmt: skip
    labels = {node.text for node in ET.fromstring(pictures["figure_2"].pictures[0][1].svg()).iter()}
    assert {"KMeans_Hybrid", "General", "Random", "93.8", "ns"} <= labels
    assert "Selections of the leader's budget, k = 2." in pictures["figure_2"].note
    assert [caption for caption, _ in pictures["figure_budgets"].pictures] == ["KMeans_Hybrid"]
    assert len(pictures["figure_3"].pictures) == 4


@pytest.mark.slow
def test_figures_show_what_leads_with_a_smaller_budget_too(small_lake: Lake, maker: Any) -> None:
    study = maker.record("small", "cccccccc")
    for budget, outcomes in ((1, "SSSS"), (2, "S...")):
        maker.test(study, "KMeans_Hybrid", budget, "BC_MLP", outcomes)
        maker.select(study, "KMeans_Hybrid", budget, KEPT["KMeans_Hybrid", budget])
    report = build_report(study_results(small_lake, study))
    (figure,) = (figure for figure in report.figures if figure.key == "figure_2")
    assert "Selections of the leader's budget, k = 1." in figure.note
    assert "100.0" in {node.text for node in ET.fromstring(figure.pictures[0][1].svg()).iter()}


@pytest.mark.slow
def test_figure_a3_has_intervals_over_selection_seeds(small_lake: Lake, maker: Any, study: str) -> None:
    def intervals() -> int:
        report = build_report(study_results(small_lake, study))
        figure = next(figure for figure in report.figures if figure.key == "figure_a3")
        return figure.pictures[0][1].svg().count('class="interval"')

    assert intervals() == 0
    maker.select(study, "Random", 2, KEPT["Random", 2], seed=1, **{**SECONDS, "selection_time_s": 0.7})
    assert intervals() == 3  # a line and its two ends


def test_the_setup_names_all_that_a_repetition_needs(report: Report) -> None:
    setup = report.setup
    assert (setup["study"], setup["pools"], setup["pool_hash"]) == (
        "tiny-aaaaaaaa",
        {"free": "0a1b2c"},
        "feed",
    )
    assert {"candidates.targets.seed", "selection_seeds", "seeds", "evaluation.seed"} <= set(setup["seeds"])
    assert setup["seeds"]["seeds"] == [0, 1]
    # 18 runs of 10, 20 and 30 ms; 4 selections of 0.5 s, 16 networks of 1.5 s
    assert setup["seconds_of_work"] == pytest.approx(
        {"plan_s": 0.18, "timing_s": 0.36, "verify_s": 0.54, "selection_s": 2.0, "train_s": 24.0}
    )
    assert {"plancurate", "ompl", "python", "torch", "prefect", "mlflow", "duckdb"} <= set(
        setup["versions_of_this_report"]
    )


@pytest.mark.slow
def test_every_command_gives_the_rows_of_its_query(lake: Lake, report: Report) -> None:
    for query in {query.command: query for table in report.tables for query in table.queries}.values():
        program, command, statement = shlex.split(query.command)
        assert (program, command) == ("plancurate", "sql")
        assert statement == query.statement
        again = lake.sql(statement).to_pylist()
        rows = lake.query(query.name, **query.parameters).to_pylist()
        assert len(again) == len(rows) > 0
        for one, other in zip(again, rows, strict=True):
            assert one == pytest.approx(other) if "test_ids" not in one else one == other
    assert all(table.queries for table in report.tables if table.key != "development")  # that is of no study


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
    sections = [Section("s", "<z>", "<p>", tables=[table])]
    text = page(Contents("<x>", ["<y>"], "<w>", sections, {"<k>": {"a": "<v>"}}))
    checked(text)
    for tag in ("<script", "<b>", "<i>", "<u>", "<x>", "<y>", "<w>", "<z>", "<k>", "<v>"):
        assert tag not in text


def test_page_markdown_and_json_are_written_with_the_same_tables(report: Report, tmp_path: Path) -> None:
    written = write_report(report, tmp_path / "tiny")
    assert written == tmp_path / "tiny" / "index.html"
    record = json.loads((tmp_path / "tiny" / "report.json").read_text(), parse_constant=pytest.fail)
    assert [table["key"] for table in record["tables"]] == [table.key for table in report.tables]
    assert record["verdict"] == list(report.verdict)
    assert record["tables"][0]["rows"][0]["successes"] == 15
    text = (tmp_path / "tiny" / "report.md").read_text()
    for table in report.tables:
        assert f"### {table.title}" in text
        assert all(query.command in text for query in table.queries)
    for link in re.findall(r"!\[[^]]*\]\(([^)]*)\)", text):
        ET.parse(tmp_path / "tiny" / link)
    assert "![" not in markdown(report, figures=False)
    assert r"p below 0.05 (\*), 0.01 (\*\*) or 0.001 (\*\*\*)" in text  # not from italic to bold
    assert "`selection_seeds`" in text
    html = (tmp_path / "tiny" / "index.html").read_text()
    assert "<code>selection_seeds</code>" in html
    assert "`" not in re.sub(r"<style>.*?</style>|<pre>.*?</pre>", "", html, flags=re.DOTALL)
    again = load_config("quick", tmp_path / "tiny" / "config.yaml", {})
    assert again.model_dump(mode="json") == report.setup["configuration"]


def test_a_report_holds_no_path_of_the_home_it_was_made_in(
    report: Report, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    write_report(report, tmp_path / "tiny")
    written = [path for path in (tmp_path / "tiny").rglob("*") if path.is_file()]
    assert len(written) > 4
    for path in written:
        text = path.read_text()
        assert str(tmp_path_factory.getbasetemp()) not in text, path
        assert not re.search(r'(href|src)="(/|file:)', text), path


@pytest.mark.slow
def test_a_study_without_general_is_compared_with_nothing(small_lake: Lake, maker: Any) -> None:
    study = maker.record("alone", "aaaaaaaa")
    maker.test(study, "Random", 2, "BC_MLP", "S...")
    maker.select(study, "Random", 2, KEPT["Random", 2])
    report = build_report(study_results(small_lake, study))
    assert "agreement" not in [table.key for table in report.tables]
    assert report.tables[0].cells[0][8:11] == ["", "", ""]
    assert "whether selecting helps is open" in report.verdict[1]
    assert report.setup["configuration"] == {}
    checked(page(report))


@pytest.mark.slow
def test_the_report_and_the_terminal_say_how_stably_scores_from_rollouts_rank(
    small_lake: Lake, maker: Any, study: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert not any(table.key == "rankings" for table in build_report(study_results(small_lake, study)).tables)
    for selector, correlations in (("CUPID", (0.5, 0.1)), ("DemoSCORE", (0.9,))):
        maker.test(study, selector, 2, "BC_MLP", "....")
        for seed, correlation in enumerate(correlations):
            maker.select(study, selector, 2, KEPT["Random", 2], seed=seed)
            maker.rank(selector, 2, correlation, seed=seed)
    report = build_report(study_results(small_lake, study))
    lines = cells(report, "rankings")
    assert lines == {("CUPID", "2"): ["2", "0.30", "0.10"], ("DemoSCORE", "2"): ["1", "0.90", "0.90"]}
    words = next(section.text for section in report.sections if section.key == "selections")
    assert words.startswith("CUPID k=2 in scene free: two halves of its rollouts rank")
    assert "DemoSCORE" not in words
    say_unsteady(small_lake, study)
    assert words in capsys.readouterr().err


def test_reasons_name_what_a_selection_lacks_against_a_random_one() -> None:
    def row(selector: str, without: float, way: float) -> CoverageRow:
        return CoverageRow("free", "", selector, 2, 1, 6, 16, 3, without, 2, 2.0, 2, 6, 2, 5, way, 1.0)

    random = row("Random", 0, 0.7)
    assert reasons(row("CUPID", 0, 0.7), random) == "not explained by coverage or by the way"
    fewer = reasons(row("CUPID", 1, 0.5), random)
    assert fewer.startswith("leaves 1 of 3 targets without data; keeps more trajectories that go a long way")


@pytest.mark.slow
def test_published_selectors_below_random_are_listed_with_their_reasons(
    small_lake: Lake, maker: Any, study: str
) -> None:
    maker.test(study, "SCIZOR", 2, "BC_MLP", "....")
    maker.select(study, "SCIZOR", 2, KEPT["Random", 2])
    report = build_report(study_results(small_lake, study))
    (row,) = shown(report, "below_random").rows
    assert row == BelowRandomRow(
        "free", "", "SCIZOR", 2, 0.0, 2 / 16, 2, 1.0, 1.0, "not explained by coverage or by the way"
    )
    assert "Published selectors below Random" in page(report)


@pytest.mark.slow
def test_several_scenes_stand_in_one_report(small_lake: Lake, maker: Any) -> None:
    study = maker.record("both", "aaaaaaaa", pools=((FREE, ""), (TABLE, "")))
    for pool, general, hybrid in ((FREE, "S...", "SSS."), (TABLE, "....", "SS..")):
        maker.test(study, "General", None, "BC_MLP", general, pool=pool)
        maker.test(study, "KMeans_Hybrid", 2, "BC_MLP", hybrid, pool=pool)
    maker.select(study, "KMeans_Hybrid", 2, KEPT["KMeans_Hybrid", 2], pool=FREE)
    report = build_report(study_results(small_lake, study))
    table = shown(report, "table_a1")
    assert table.headers[:3] == ("scene", "selector", "k")
    assert [line[:5] for line in table.cells] == [
        ["all scenes", "KMeans_Hybrid", "2", "8", "62.5"],
        ["all scenes", "General", "all", "8", "12.5"],
        ["free", "KMeans_Hybrid", "2", "4", "75.0"],
        ["free", "General", "all", "4", "25.0"],
        ["table", "KMeans_Hybrid", "2", "4", "50.0"],
        ["table", "General", "all", "4", "0.0"],
    ]
    assert report.verdict[0].startswith("all scenes: ")
    figures = {figure.key: figure for figure in report.figures}
    drawn = figures["figure_scenes_displaced"].pictures[0][1].svg()
    assert [drawn.count(f">{scene}</text>") for scene in ("free", "table")] == [1, 1]
    assert figures["figure_2"].note.startswith("All scenes.")
    checked(page(report))


def test_a_long_name_is_broken_into_lines_that_fit() -> None:
    assert broken("clutter-7-12-0.06", 8) == ["clutter-", "7-12-", "0.06"]
    assert broken("BC_RNN_Dropout", 8) == ["BC_RNN_", "Dropout"]
    assert broken("all scenes", 12) == ["all scenes"]
