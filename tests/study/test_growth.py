"""Studies that grow by training targets or runs, on made-up trials."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study import growth
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.growth import grown, known_sizes, smaller, with_runs, with_targets
from plancurate.tasks.study.run_line import held_evaluations, run_line

from ..studies import StudyMaker

CONFIG = StudyConfig(name="nightly", n_targets=2, planners=("RRTConnect",), policies=("BC_MLP",))
XS = [0.1 * i for i in range(40)]


@pytest.fixture
def study(tmp_path: Path) -> StudyContext:
    return open_study(CONFIG, Home(tmp_path))


@pytest.fixture
def ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "missing_evaluations", lambda study: [])


def ran(study: StudyContext, n_targets: int, outcomes: str = "S", selector: str = "KMeans") -> StudyContext:
    """Record that the study was tested with so many training targets."""
    return was_tested(with_targets(study, n_targets), outcomes, selector)


def was_tested(study: StudyContext, outcomes: str = "S", selector: str = "KMeans") -> StudyContext:
    """Record that the study was tested."""
    maker, pool = StudyMaker(study.lake), study.pools[0].partition
    config, n_targets = study.config.model_dump_json(), study.config.n_targets
    maker.record(study.config.name, study.key, ((pool, ""),), n_targets=n_targets, config=config)
    maker.test(study.study, selector, 20, "BC_MLP", outcomes, kind="unseen", pool=pool, xs=XS)
    return study


def test_sizes_are_those_of_the_same_study_alone(study: StudyContext) -> None:
    ran(study, 4)
    ran(study, 2)
    ran(open_study(CONFIG.model_copy(update={"name": "other"}), study.home), 7)
    ran(open_study(CONFIG.model_copy(update={"budgets": (5,)}), study.home), 8)
    StudyMaker(study.lake).record(
        "nightly", with_targets(study, 9).key, n_targets=9
    )  # stopped before any test
    assert known_sizes(study) == [2, 4]
    by, found = smaller(with_targets(study, 4))
    assert (by, found.study) == ("targets", study.study)
    assert smaller(study) is None


@pytest.mark.usefixtures("ended")
def test_each_run_adds_targets_to_the_largest(study: StudyContext) -> None:
    assert grown(CONFIG, study.home, 3) == CONFIG
    ran(study, 4)
    ran(study, 2)
    assert grown(CONFIG, study.home, 3) == CONFIG.model_copy(update={"n_targets": 7})
    assert grown(CONFIG, study.home, 0) == CONFIG
    wished = CONFIG.model_copy(update={"n_targets": 20})
    assert grown(wished, study.home, 3) == wished


def test_what_was_stopped_half_way_is_gone_on_with(
    study: StudyContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran(study, 4)
    monkeypatch.setattr(growth, "missing_evaluations", lambda study: ["one"])
    assert grown(CONFIG, study.home, 3).n_targets == 4


@pytest.mark.usefixtures("ended")
def test_numbers_that_make_no_study_are_refused(study: StudyContext) -> None:
    ran(study, 4)
    for more in (-1, 1_000_000):
        with pytest.raises(PlancurateError, match=rf"^grow = {more}: "):
            grown(CONFIG, study.home, more)


def test_a_grown_study_keeps_its_pools(study: StudyContext) -> None:
    larger = with_targets(study, 5)
    assert larger.pools == study.pools
    assert larger.study != study.study


def test_a_run_says_that_it_had_nothing_to_do(study: StudyContext) -> None:
    ran(study, 2)
    said = run_line(study, held_evaluations(study), ["a champion"])
    assert (
        said
        == f"{study.study}: nothing to do, all 1 networks were tested before; `grow` adds targets or runs; a champion"
    )


def test_a_run_that_goes_on_counts_what_is_new(study: StudyContext) -> None:
    ran(study, 2)
    before = held_evaluations(study)
    ran(study, 2, selector="General")
    assert run_line(study, before, []) == f"{study.study}: went on, 1 of 2 networks tested now"


def test_a_first_run_says_that_there_is_nothing_to_compare_with(study: StudyContext) -> None:
    ran(study, 2)
    assert run_line(study, frozenset(), []).endswith(" training targets, 1 network tested")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("now", "chance"), [("S" * 30, "better"), ("S" * 11, "it may be chance"), ("", "worse")]
)
def test_a_grown_study_is_compared_with_the_one_before(study: StudyContext, now: str, chance: str) -> None:
    ran(study, 2, "S" * 10 + "." * 30)
    larger = ran(study, 5, now.ljust(40, "."))
    said = run_line(larger, frozenset(), [])
    assert said.startswith(
        f"{larger.study}: 5 training targets, 1 network tested; KMeans k=20 from 25.0 to {100 * len(now) / 40} %, "
    )
    assert said.endswith(f", {chance} (2 training targets before, unseen tests)")


@pytest.mark.usefixtures("ended")
def test_a_study_may_grow_by_runs_as_well(study: StudyContext) -> None:
    assert grown(CONFIG, study.home, 2, "runs") == CONFIG
    was_tested(study)
    was_tested(with_runs(study, 7))
    ran(study, 4)  # has grown by targets, and counts for no number of runs
    assert known_sizes(study, "runs") == [3, 7]
    larger = grown(CONFIG, study.home, 2, "runs")
    assert (larger.candidates.plan.runs, larger.n_targets) == (9, 2)
    assert open_study(larger, study.home).study == with_runs(study, 9).study
    by, found = smaller(with_runs(study, 9))
    assert (by, found.study) == ("runs", with_runs(study, 7).study)


def test_runs_that_a_variant_fixes_do_not_grow(study: StudyContext) -> None:
    config = CONFIG.model_copy(update={"pools": {"many": {"plan": {"runs": 9}}}})
    with pytest.raises(PlancurateError, match=r"^grow_by = runs: pools\.many\.plan\.runs "):
        grown(config, study.home, 1, "runs")


@pytest.mark.slow
def test_a_study_that_grew_by_runs_is_compared_with_the_one_before(study: StudyContext) -> None:
    was_tested(study, "S" * 10 + "." * 30)
    larger = was_tested(with_runs(study, 5), "S" * 30 + "." * 10)
    said = run_line(larger, frozenset(), [])
    assert said.startswith(
        f"{larger.study}: 2 training targets, 1 network tested; KMeans k=20 from 25.0 to 75.0 %, "
    )
    assert said.endswith(", better (3 runs of each planner to a target before, unseen tests)")
