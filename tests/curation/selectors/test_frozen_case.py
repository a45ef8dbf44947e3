"""A tiny pool whose selections are pinned together with each selector's revision."""

from __future__ import annotations

import hashlib

import pytest

from plancurate.tasks.curation.selectors.base import find_selector, selector_names

from .defects import Bed, chosen, defective_pool

# By selector and revision.
FROZEN = {
    ("DBSCAN", 1): "1c89274e3355595e",
    ("DBSCAN_Hybrid", 2): "b45ae3b304d62a0f",
    ("DBSCAN_Hybrid_Worst", 1): "5d9b675862ba1c80",
    ("DTW", 2): "466d2aeba58d7cc2",
    ("DTW_Hybrid", 2): "cfef697a34973d28",
    ("General", 1): "8292a1921d242f49",
    ("Hierarchical", 1): "b31cdc51dda723ff",
    ("Hierarchical_Hybrid", 2): "b45ae3b304d62a0f",
    ("Hierarchical_Hybrid_Worst", 1): "5d9b675862ba1c80",
    ("KMeans", 1): "6fadb58409cd43ef",
    ("KMeans_Hybrid", 2): "b45ae3b304d62a0f",
    ("KMeans_Hybrid_Worst", 1): "5d9b675862ba1c80",
    ("DemInf", 1): "03073d8a14fef4c6",
    ("DemInf_Native", 1): "1a97fe97eafa441b",
    ("ModeConsistent", 1): "323b0ac85d26098b",
    ("Random", 1): "594654eab6e2b309",
    ("Repair", 1): "8292a1921d242f49",
    ("RuleBased_General", 2): "5510f52555782107",
}
# Selectors that train a network, with as little of it as decides: by the beginning of their names.
LEARNED: dict[str, dict[str, object]] = {
    "BehaviorRetrieval": {"vae_steps": 20},
    "CUPID": {"steps": 20, "rollouts": 4, "projection": 4},
    "DemoSCORE": {"steps": 200, "rollouts": 4, "classifier_steps": 20, "policies": 2},
    "SCIZOR": {"classifier_steps": 20},
}
FROZEN_LEARNED = {
    ("BehaviorRetrieval", 2): "18a515c9fa6826c7",
    ("BehaviorRetrieval_Global", 2): "18a515c9fa6826c7",
    ("BehaviorRetrieval_Native", 2): "9b334a99b0ac9b97",
    ("CUPID", 3): "c76cae21d8023e6f",
    ("CUPID_Global", 3): "be38671e9d5f96d4",
    ("CUPID_Native", 3): "6152227b9f4afde0",
    ("DemoSCORE", 2): "33511492fbcf0271",
    ("DemoSCORE_Native", 2): "11dc31f79249e8d1",
    ("SCIZOR", 2): "82e04d8884d2cb33",
    ("SCIZOR_Global", 2): "2852eb77c6ca60a6",
    ("SCIZOR_Native", 1): "6db4feb8c475f56d",
}
ADVICE = (
    "{name} keeps other trajectories of the same pool than before: raise its revision where it is registered, "
    "and pin the new hash here"
)


@pytest.fixture(scope="module")
def bed() -> Bed:
    return defective_pool(seed=0)


@pytest.fixture(scope="module")
def small_bed() -> Bed:
    return defective_pool(seed=0, targets=2, per_target=10)


def fingerprint(bed: Bed, name: str, **params: object) -> str:
    """Hash of the kept ids for the least budget."""
    kept = chosen(bed, name, budget=2, **params)
    return hashlib.sha256("\n".join(kept.ids).encode()).hexdigest()[:16]


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in selector_names() if not n.startswith(tuple(LEARNED))])
def test_selections_change_with_the_revision_alone(bed: Bed, name: str) -> None:
    assert fingerprint(bed, name) == FROZEN[name, find_selector(name).revision], ADVICE.format(name=name)


@pytest.mark.training
@pytest.mark.parametrize("name", [n for n in selector_names() if n.startswith(tuple(LEARNED))])
def test_learned_selections_change_with_the_revision_alone(small_bed: Bed, name: str) -> None:
    params = next(params for family, params in LEARNED.items() if name.startswith(family))
    frozen = FROZEN_LEARNED[name, find_selector(name).revision]
    assert fingerprint(small_bed, name, **params) == frozen, ADVICE.format(name=name)
