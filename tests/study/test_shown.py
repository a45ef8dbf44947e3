"""What the terminal shows of a study: the verdict, the table of success rates, the printed rows."""

from __future__ import annotations

import io
import json
from datetime import UTC, datetime
from typing import Any

import pytest
from rich.console import Console

from plancurate.errors import PlancurateError
from plancurate.flows.cli.compare import compare
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.cli.report import report
from plancurate.flows.cli.tables import matrix, matrix_markdown, report_markdown
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.report import build_report
from plancurate.tasks.study.results import KindResults, study_results
from plancurate.tasks.study.rows import REPORT_FIELDS
from plancurate.tasks.study.text import whole_percents

from ..lakes import copied
from ..studies import StudyMaker

FREE = {"robot": "h2017", "scene": "free", "pool": "0a1b2c"}
TABLE = {"robot": "h2017", "scene": "table", "pool": "3d4e5f"}
GOOD, BAD = 39 * "S" + ".", 8 * "S" + 32 * "."


@pytest.fixture(scope="module")
def tests(small_lake_once: Lake, tmp_path_factory: pytest.TempPathFactory) -> KindResults:
    """One scene and all four policies, with a selector of a long name."""
    lake = copied(small_lake_once, tmp_path_factory.mktemp("shown"))
    maker = StudyMaker(lake)
    study = maker.record("long", "aaaaaaaa")
    for policy in ("BC_MLP", "BC_RNN", "BC_RNN_Dropout", "BC_RNN_MDN"):
        maker.test(study, "General", None, policy, BAD)
        maker.test(study, "BehaviorRetrieval_Native", 20, policy, GOOD, hard=True)
    maker.refer(
        study, Planner=36 * "S" + "ssss", Replay=20 * "S" + 16 * "." + "ss.h", StraightLine=36 * "S" + "hhhh"
    )
    return study_results(lake, study).headline


def lines(tests: KindResults) -> list[str]:
    """The printed matrix, line by line."""
    text = io.StringIO()
    Console(file=text, width=200).print(matrix(tests, "Success"))
    return [line.rstrip() for line in text.getvalue().splitlines()]


@pytest.mark.slow
def test_the_matrix_has_a_column_for_each_policy_in_80_characters(tests: KindResults) -> None:
    shown = lines(tests)
    assert max(map(len, shown)) <= 80
    best, general = tests.summaries
    assert shown[-5].split() == [
        "BehaviorRetrieval_Native", "20", *["97.5"] * 4, "97.5", "***", whole_percents(best.interval), "97.5", "97.5",
    ]  # fmt: skip
    assert shown[-4].split() == [
        "General", "all", *["20.0"] * 4, "20.0", whole_percents(general.interval), "20.0", "\N{EN DASH}",
    ]  # fmt: skip
    assert [line.split() for line in shown[-3:]] == [
        ["Planner", "\N{EN DASH}", "100.0", "[91,100]", "100.0", "100.0"],
        ["Replay", "\N{EN DASH}", "55.0", "[40,69]", "55.0", "66.7"],
        ["StraightLine", "\N{EN DASH}", "90.0", "[77,96]", "90.0", "0.0"],
    ]
    assert (
        "| Replay | \N{EN DASH} |  |  |  |  | 55.0 | [39.8, 69.3] |  | 55.0 | 66.7 | 3 |"
        in matrix_markdown(tests)
    )
    assert "all policies" in shown[3]
    assert "| General | all | 20.0 | 20.0 | 20.0 | 20.0 | 20.0 |" in matrix_markdown(tests)


@pytest.mark.slow
def test_of_several_scenes_the_matrix_has_a_column_each_and_their_total(small_lake: Lake, maker: Any) -> None:
    study = maker.record("both", "aaaaaaaa", pools=((FREE, ""), (TABLE, "")))
    for pool, general, hybrid in ((FREE, "S...", "SSS."), (TABLE, "....", "SS..")):
        maker.test(study, "General", None, "BC_MLP", general, pool=pool)
        maker.test(study, "KMeans", 2, "BC_MLP", hybrid, pool=pool)
    maker.test(study, "Random", 2, "BC_MLP", "SSSS", pool=FREE)
    maker.refer(study, pool=FREE, Planner="SSSS")
    maker.refer(study, pool=TABLE, Planner="SSh.")
    tests = study_results(small_lake, study).headline
    shown = lines(tests)
    assert shown[2].split() == ["selector", "k", "free", "table", "all", "scenes", "tled", "hard"]
    assert [line.split()[:5] for line in shown[3:]] == [
        ["KMeans", "2", "75.0", "50.0", "62.5"],
        ["General", "all", "25.0", "0.0", "12.5"],
        ["Planner", "\N{EN DASH}", "100.0", "50.0", "75.0"],
    ]
    header = report_markdown(tests.networks).splitlines()[0]
    assert header.startswith("| scene | selector | budget | policy | seed | n |")


def test_printed_rows_leave_out_columns_that_say_nothing(tests: KindResults) -> None:
    header, _, first, *_ = report_markdown(tests.networks).splitlines()
    assert header.startswith("| selector | budget | policy | seed | n | successes | success_rate |")
    assert first.startswith("| BehaviorRetrieval_Native | 20 | BC_MLP | 0 | 40 | 39 | 0.975 |")
    assert report_markdown(tests.networks).splitlines()[-1].startswith("| General | all | BC_RNN_MDN |")


@pytest.mark.slow
def test_the_report_command_shows_the_study_that_was_asked_for(
    small_lake: Lake, maker: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    for key, month, outcomes in (("aaaaaaaa", 1, "S..."), ("bbbbbbbb", 2, "SS")):
        study = maker.record("tiny", key, run_at=datetime(2026, month, 1, tzinfo=UTC))
        maker.test(study, "General", None, "BC_MLP", outcomes)
        maker.select(study, "General", None, [(0, "RRT", 0)])
    home = small_lake.root.parent
    for key, n in ((None, 2), ("aaaaaaaa", 4), ("bbbbbbbb", 2)):
        report(study="tiny", key=key, format="json", options=HomeOptions(home=home))
        said = capsys.readouterr()
        (row,) = json.loads(said.out)
        assert (tuple(row), row["n"], row["kind"]) == (REPORT_FIELDS, n, "displaced")
        page = home / "reports" / f"tiny-{key or 'bbbbbbbb'}" / "index.html"
        assert page.is_file()
        assert str(page) in said.err
    with pytest.raises(PlancurateError, match="no unseen tests; it has displaced"):
        report(study="tiny", kind="unseen", options=HomeOptions(home=home))


@pytest.mark.slow
def test_printed_rows_are_of_every_kind_of_test_unless_one_is_named(
    small_lake: Lake, maker: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    study = maker.record("tiny", "aaaaaaaa")
    for kind, outcomes in (("displaced", "S.."), ("unseen", "SR")):
        maker.test(study, "General", None, "BC_MLP", outcomes, kind=kind, hard=kind == "unseen")
    maker.select(study, "General", None, [(0, "RRT", 0)])
    options = HomeOptions(home=small_lake.root.parent)
    fields = ("kind", "n", "successes", "settled", "hard_n", "hard_successes", "hard_settled")

    report(study="tiny", format="json", options=options)
    rows = json.loads(capsys.readouterr().out)
    assert [[row[name] for name in fields] for row in rows] == [
        ["unseen", 2, 2, 1, 2, 2, 1],
        ["displaced", 3, 1, 1, 0, 0, 0],
    ]
    report(study="tiny", kind="displaced", format="json", options=options)
    assert json.loads(capsys.readouterr().out) == rows[1:]


@pytest.mark.slow
def test_a_degenerate_pool_is_called_so_wherever_its_results_are_shown(
    small_lake: Lake, maker: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    same = {"joint_movement": 1.0, "path_length": 1.0, "smoothness": 1.0}
    for run in range(4):
        maker.plan("EST", 0, key=str(run), run=run, trajectory_id=f"copy{run}", **same)
    for name, planner in (("copies", "EST"), ("sound", "PRM")):
        study = maker.record(name, "aaaaaaaa", planners=[planner], n_targets=1)
        for kind in ("displaced", "unseen"):
            maker.test(study, "General", None, "BC_MLP", "SS", kind=kind)
        maker.select(study, "General", None, [(0, planner, 0)])
    words, home = "only 1 of its 4 candidates differ", HomeOptions(home=small_lake.root.parent)

    for name, times in (("copies", 1), ("sound", 0)):
        report(study=name, options=home)
        said = capsys.readouterr()
        assert (said.err.count(words), said.out.count(words)) == (times, 0)
        page = build_report(study_results(small_lake, f"{name}-aaaaaaaa"))
        assert sum(words in sentence for sentence in page.verdict) == times
        told = {section.key for section in page.sections if words in section.text}
        assert told == ({"fresh", "success"} if times else set())
    compare("copies", "sound", options=home)
    assert capsys.readouterr().err.count(words) == 1
