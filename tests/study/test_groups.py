"""Which networks are worked on together."""

from __future__ import annotations

import pytest

from plancurate.tasks.curation.selector_choice import SelectorChoice
from plancurate.tasks.study.networks import GROUP, Network, groups
from plancurate.tasks.study.selections import WantedSelection


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
    together = groups(wanted)
    assert [network for group in together for network in group] == wanted
    sizes = [len(group) for group in together]
    assert max(sizes) <= GROUP
    assert max(sizes) - min(sizes) <= 1
    built = sum(len({network.selection.selection_id for network in group}) for group in together)
    assert built <= selections + len(together) - 1


def test_networks_of_several_policies_or_pools_are_never_in_one_group() -> None:
    wanted = networks(2, 1) + networks(2, 1, pool="other") + networks(2, 1, policy="BC_RNN")
    assert [{(n.policy, n.selection.pool) for n in group} for group in groups(wanted)] == [
        {("BC_MLP", "pool")}, {("BC_MLP", "other")}, {("BC_RNN", "pool")},
    ]  # fmt: skip
