"""Which network becomes a policy's champion, on made-up trials."""

from __future__ import annotations

from pathlib import Path

import pytest

from plancurate.tasks.lake.home import Home
from plancurate.tasks.study import champions
from plancurate.tasks.study.champions import Challenge, challenges, champion_name, crown_networks, winner
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import StudyContext, open_study
from plancurate.tasks.study.mlflow_records import StudyRun
from plancurate.tasks.study.statistics import Outcomes
from plancurate.tasks.study.trial_results import network_rows

from ..studies import StudyMaker

CONFIG = StudyConfig(name="nightly", planners=("RRTConnect",), policies=("BC_MLP",))
XS = [0.1 * i for i in range(20)]
OLD = "KMeans-20-BC_MLP-0-0-0-unseen"


@pytest.fixture
def study(tmp_path: Path) -> StudyContext:
    """Last night's network fails at half of 20 targets; tonight's tests have the same places, other numbers."""
    study = open_study(CONFIG, Home(tmp_path))
    maker, pool = StudyMaker(study.lake), study.pools[0].partition
    last_night = maker.record("nightly", "00000000", ((pool, ""),))
    maker.test(last_night, "KMeans", 20, "BC_MLP", "S." * 10, kind="unseen", pool=pool, xs=XS)
    maker.record("nightly", study.key, ((pool, ""),))
    for selector, outcomes in (("Random", "S." * 5 + "SS" * 5), ("General", "." * 20), ("DBSCAN", "S" * 20)):
        maker.test(study.study, selector, 20, "BC_MLP", outcomes[::-1], kind="unseen", pool=pool, xs=XS[::-1])
    return study


def test_networks_meet_the_champion_at_the_same_places(study: StudyContext) -> None:
    found = challenges(study, study.pools[0], "BC_MLP", OLD)
    half = Outcomes(10, 20)
    assert [(one.challenger, one.champion) for one in found] == [
        (Outcomes(20, 20), half), (Outcomes(15, 20), half), (Outcomes(0, 20), half),
    ]  # fmt: skip
    assert [one.p for one in found] == pytest.approx([2 / 2**10, 2 / 2**5, 2 / 2**10])
    assert challenges(study, study.pools[0], "BC_MLP", "elsewhere") == []


def challenge(successes: int, p: float) -> Challenge:
    return Challenge(f"{successes} {p}", Outcomes(successes, 20), Outcomes(10, 20), p)


def test_only_better_beyond_chance_wins_and_many_challengers_need_more() -> None:
    assert winner([]) is None
    assert winner([challenge(16, 0.03)]).evaluation_id == "16 0.03"
    assert winner([challenge(16, 0.03), challenge(10, 1.0)]) is None
    assert winner([challenge(0, 0.001)]) is None
    both = winner([challenge(20, 0.001), challenge(19, 0.0001)])
    assert (both.evaluation_id, both.p) == ("20 0.001", 0.001)


def test_the_first_is_the_best_and_only_a_better_one_follows(
    study: StudyContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    registered: dict[str, str] = {}
    reasons: list[str] = []

    def register(run: StudyRun, name: str, key: str, reason: str) -> None:
        registered[name] = key
        reasons.append(reason)

    monkeypatch.setattr(champions, "champion", lambda uri, name: registered.get(name))
    monkeypatch.setattr(champions, "set_champion", register)
    run = StudyRun("", "", "", study.study, frozenset(), {})
    tested = {
        f"{row.selector}-20-BC_MLP-0-0-0-unseen": row
        for row in network_rows(study.lake, study.study, "unseen")
    }

    monkeypatch.setattr(champions, "tested_at_unseen", lambda _: {(study.pools[0].pool, "BC_MLP"): tested})

    assert crown_networks(study, run) == ["first champions: nightly-BC_MLP"]
    assert reasons == ["champion nightly-BC_MLP is DBSCAN k=20 seed 0, the first: 100.0 % of 20 unseen tests"]
    assert crown_networks(study, run) == ["champions that stay: nightly-BC_MLP"]
    registered["nightly-BC_MLP"] = OLD
    moved = (
        "champion nightly-BC_MLP is now DBSCAN k=20 seed 0: 100.0 instead of 50.0 % of 20 unseen tests, "
        "p = 0.006 (paired)"
    )
    assert crown_networks(study, run) == [moved]
    assert reasons[1:] == [moved]
    assert registered == {"nightly-BC_MLP": "DBSCAN-20-BC_MLP-0-0-0-unseen"}


def test_a_champion_is_named_by_study_and_policy_and_by_its_pool_among_several(tmp_path: Path) -> None:
    one = open_study(CONFIG, Home(tmp_path))
    assert champion_name(one, one.pools[0], "BC_MLP") == "nightly-BC_MLP"
    two = open_study(CONFIG.model_copy(update={"scenes": ("free", "table")}), Home(tmp_path))
    assert champion_name(two, two.pools[1], "BC_MLP") == "nightly-table-BC_MLP"
