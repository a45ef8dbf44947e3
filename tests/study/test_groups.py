"""Which networks are worked on together."""

from __future__ import annotations

from dataclasses import replace

import pytest

from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.study import networks as networks_of
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.networks import GROUP, Network, groups, twins
from plancurate.tasks.study.selections import WantedSelection

STUDY: StudyContext = object()  # type: ignore[assignment]  # nothing of it is asked, for contents are given here


@pytest.fixture(autouse=True)
def contents(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What selections keep, by their ids; each its own unless it is said here."""
    given: dict[str, str] = {}
    monkeypatch.setattr(
        networks_of, "kept_content", lambda _, one: given.get(one.selection_id, one.selection_id)
    )
    return given


def networks(selections: int, seeds: int, pool: str = "pool", policy: str = "BC_MLP") -> list[Network]:
    wanted = [
        WantedSelection(pool, "hash", SelectorChoice(name="General"), None, 0, f"{pool}-{i}")
        for i in range(selections)
    ]
    return [
        Network(policy, one, seed, f"{one.selection_id}-{seed}") for one in wanted for seed in range(seeds)
    ]


@pytest.mark.parametrize(("selections", "seeds"), [(1, 1), (8, 3), (9, 3), (25, 3), (2, 40)])
def test_groups_are_about_equal_and_keep_neighbours_together(selections: int, seeds: int) -> None:
    wanted = networks(selections, seeds)
    together = groups(STUDY, wanted)
    assert [network for group in together for network in group] == wanted
    sizes = [len(group) for group in together]
    assert max(sizes) <= GROUP
    assert max(sizes) - min(sizes) <= 1
    built = sum(len({network.selection.selection_id for network in group}) for group in together)
    assert built <= selections + len(together) - 1


def test_networks_of_several_policies_or_pools_are_never_in_one_group() -> None:
    wanted = networks(2, 1) + networks(2, 1, pool="other") + networks(2, 1, policy="BC_RNN")
    assert [{(n.policy, n.selection.pool) for n in group} for group in groups(STUDY, wanted)] == [
        {("BC_MLP", "pool")}, {("BC_MLP", "other")}, {("BC_RNN", "pool")},
    ]  # fmt: skip


def test_networks_that_learn_from_the_same_from_one_seed_are_twins_unless_corrected(
    contents: dict[str, str],
) -> None:
    contents |= {"pool-0": "same", "pool-2": "same"}
    wanted = networks(3, 2)
    first, other_seed, unlike, _, twin, _ = wanted
    assert twins(STUDY, wanted)[:3] == [[first, twin], [other_seed, wanted[5]], [unlike]]
    corrected = [replace(network, round=1) for network in (first, twin)]
    assert twins(STUDY, corrected) == [[corrected[0]], [corrected[1]]]


def test_twins_stay_in_one_group_however_many_there_are(contents: dict[str, str]) -> None:
    contents |= {f"pool-{i}": f"content {i % 30}" for i in range(90)}
    together = groups(STUDY, networks(90, 1))
    assert [len(group) for group in together] == [45, 45]
    assert all(len(twins(STUDY, group)) == 15 for group in together)
