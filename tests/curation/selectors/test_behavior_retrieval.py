from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from sklearn.metrics import roc_auc_score

from plancurate.tasks.curation.selectors.behavior_retrieval import (
    BehaviorRetrievalSettings,
    NativeSettings,
    Retrieval,
    native_windows,
    near_enough,
    nearest,
    retrieve,
    task_distances,
)
from plancurate.tasks.curation.selectors.transitions import load_transitions, standardised
from plancurate.tasks.curation.selectors.vae import train_autoencoder
from plancurate.tasks.learning.demonstrations import demonstrations

from .defects import (
    CLEAN,
    DEFECTS,
    ROBOT,
    SCENE,
    Bed,
    bed_of,
    chosen,
    curve,
    defective_pool,
    far_offsets,
    problem,
    tool_positions,
)

pytestmark = pytest.mark.training

FEW = {"vae_steps": 20}
"""For what does not depend on how good the embedding is."""


@pytest.fixture(scope="module")
def bed() -> Bed:
    return defective_pool(seed=0)


@pytest.fixture(scope="module")
def found(bed: Bed) -> Retrieval:
    return retrieve(problem(bed), BehaviorRetrievalSettings())


def scored(bed: Bed, found: Retrieval) -> tuple[np.ndarray, np.ndarray]:
    """Mean distances and labels of the candidates that are ranked."""
    ranked = found.place < 0
    return found.transitions.mean(found.distance)[ranked], bed.label[ranked]


def test_detours_and_wrong_targets_are_found(
    bed: Bed, found: Retrieval, record_property: Callable[[str, object], None]
) -> None:
    distance, label = scored(bed, found)
    areas = {}
    for defect in DEFECTS:
        rows = np.isin(label, [CLEAN, defect])
        areas[defect] = roc_auc_score(label[rows] == defect, distance[rows])
        record_property(f"BehaviorRetrieval_{defect}", round(float(areas[defect]), 3))
    assert areas["detour"] > 0.9
    assert areas["wrong_target"] > 0.9


def test_the_autoencoder_restores_trajectories_it_was_not_trained_on() -> None:
    steps = load_transitions(problem(defective_pool(0, targets=12, per_target=40)))
    rows = standardised(np.concatenate([steps.observations, steps.actions], axis=1))
    held_out = steps.candidate % 5 == 0
    rng = torch.Generator().manual_seed(0)
    default = BehaviorRetrievalSettings().vae_steps
    vae = train_autoencoder(rows[~held_out], 2 * ROBOT.dof, default, rng)
    error = (vae.reconstructed(rows[held_out]) - rows[held_out]) ** 2
    assert error.mean() < 0.05 * rows[held_out].var()
    assert error.mean(axis=0).max() < 0.15  # no coordinate is left out


def test_nearest_neighbours_are_exact() -> None:
    rng = np.random.default_rng(0)
    points, references = (rng.normal(size=(n, 18)).astype(np.float32) for n in (5000, 70))
    points[4321] = references[7]
    expected = np.linalg.norm(points[:, None] - references, axis=2).min(axis=1)
    np.testing.assert_allclose(nearest(points, references), expected, atol=1e-5)
    assert nearest(points, references)[4321] == 0


def test_task_steps_are_near_nothing_but_their_own_target(found: Retrieval) -> None:
    embedding = np.arange(8, dtype=np.float32)[:, None]
    target = np.array([0, 0, 0, 0, 1, 1, 1, 1])
    of_task = np.array([1, 0, 0, 0, 0, 0, 0, 1], dtype=bool)
    assert task_distances(embedding, target, of_task).tolist() == [0, 1, 2, 3, 3, 2, 1, 0]
    demos = found.place >= 0
    assert (np.bincount(found.target[demos]) == 5).all()
    assert not np.any(found.transitions.mean(found.distance)[demos])
    assert np.all(found.transitions.mean(found.distance)[~demos] >= 0)


def test_task_demonstrations_of_other_targets_resemble_less(bed: Bed, found: Retrieval) -> None:
    steps = found.transitions
    rows = standardised(np.concatenate([steps.observations, steps.actions], axis=1))
    target, of_task = found.target[steps.candidate], found.place[steps.candidate] >= 0
    shuffled = np.where(of_task, (target + 1) % bed.pool.n_targets, target)
    ranked = ~of_task
    own = task_distances(rows, target, of_task)[ranked]
    others = task_distances(rows, shuffled, of_task)[ranked]
    assert others.mean() > 1.5 * own.mean()


@pytest.mark.parametrize(("budget", "demos"), [(1, 0), (5, 1), (20, 5)])
def test_each_target_keeps_its_budget_task_demonstrations_included(bed: Bed, budget: int, demos: int) -> None:
    kept = chosen(bed, "BehaviorRetrieval", budget, **FEW).kept
    assert (np.bincount(kept["target_id"].to_numpy()) == budget).all()
    score = kept["score"].to_numpy()
    # A copy of a task demonstration is at no distance either, so there may be more of them.
    assert np.sum(score == 0) >= demos * bed.pool.n_targets
    if demos:
        assert (score[kept["rank"].to_numpy() <= demos] == 0).all()


def test_a_budget_of_all_candidates_keeps_them_all() -> None:
    small = defective_pool(1, targets=2, per_target=10)
    assert len(chosen(small, "BehaviorRetrieval", 10, **FEW).ids) == 20
    assert len(chosen(small, "BehaviorRetrieval_Global", 10, **FEW).ids) == 20


def test_the_global_one_keeps_as_many_wherever_they_lead(bed: Bed) -> None:
    kept = chosen(bed, "BehaviorRetrieval_Global", 5, **FEW).kept
    counts = np.bincount(kept["target_id"].to_numpy(), minlength=bed.pool.n_targets)
    assert counts.sum() == 5 * bed.pool.n_targets
    assert counts.min() >= 1  # the task demonstration
    assert counts.max() > 5


@pytest.mark.parametrize(
    "name", ["BehaviorRetrieval", "BehaviorRetrieval_Global", "BehaviorRetrieval_Native"]
)
def test_the_seed_decides_and_the_number_of_threads_does_not(bed: Bed, name: str) -> None:
    budget = None if name.endswith("Native") else 5
    threads = torch.get_num_threads()
    kept = []
    try:
        for count in (1, 2):
            torch.set_num_threads(count)
            kept.append(chosen(bed, name, budget, seed=3, **FEW))
    finally:
        torch.set_num_threads(threads)
    assert kept[0].kept.equals(kept[1].kept)
    assert not kept[0].kept.equals(chosen(bed, name, budget, seed=4, **FEW).kept)


def test_privileged_task_demonstrations_are_the_shortest(bed: Bed) -> None:
    found = retrieve(problem(bed), BehaviorRetrievalSettings(task="shortest", vae_steps=1))
    length = bed.pool.candidates["path_length"].to_numpy()
    for target in range(bed.pool.n_targets):
        here = found.target == target
        demos = length[here & (found.place >= 0)]
        assert demos.max() <= length[here & (found.place < 0)].min()


def test_an_outlier_moves_what_delta_keeps_but_not_what_a_share_keeps() -> None:
    distance = np.random.default_rng(0).gamma(4, size=1000)
    far = np.where(distance == distance.max(), 3 * distance, distance)
    share, delta = NativeSettings(kept_share=0.25), NativeSettings(delta=0.85)
    assert (near_enough(far, share) == near_enough(distance, share)).all()
    assert near_enough(distance, share).sum() == 250
    assert near_enough(far, delta).sum() > 2 * near_enough(distance, delta).sum()


@pytest.mark.parametrize("share", [0.1, 0.25])
def test_the_native_one_draws_task_and_retrieved_windows_equally_often(
    bed: Bed, found: Retrieval, share: float
) -> None:
    kept = native_windows(found, NativeSettings(kept_share=share))
    assert kept.steps is not None
    assert kept.weight is not None
    paths = [bed.paths[row] for row in kept.rows]
    data = demonstrations(
        ROBOT,
        SCENE,
        paths,
        bed.pool.target_positions()[bed.target[kept.rows]],
        steps=kept.steps,
        weights=kept.weight,
    )
    episode = np.searchsorted(data.starts, data.window_starts, side="right") - 1
    drawn = np.asarray(data.window_weights)
    demo = found.place[kept.rows[episode]] >= 0
    for target in range(bed.pool.n_targets):
        here = bed.target[kept.rows[episode]] == target
        assert drawn[here & demo].sum() == pytest.approx(drawn[here & ~demo].sum())
    ranked = found.place[found.transitions.candidate] < 0
    steps = sum(len(waypoints) for waypoints in kept.steps if waypoints is not None)
    assert steps / ranked.sum() == pytest.approx(share, abs=0.01)
    assert sum(waypoints is None for waypoints in kept.steps) == 5 * bed.pool.n_targets


def test_what_windows_hold_is_never_glued(bed: Bed, found: Retrieval) -> None:
    kept = native_windows(found, NativeSettings())
    paths = [bed.paths[row] for row in kept.rows]
    data = demonstrations(
        ROBOT, SCENE, paths, np.zeros((len(paths), 3)), steps=kept.steps, weights=kept.weight
    )
    q = data.observations[data.windows(data.window_starts, 10)][:, :, 3:]
    assert np.abs(np.diff(q, axis=1)).max() <= max(np.abs(np.diff(p, axis=0)).max() for p in paths) + 1e-6


def test_a_target_with_a_single_candidate_keeps_it_unweighted() -> None:
    ends = ROBOT.home + far_offsets(np.random.default_rng(0), 2)
    paths = [curve(np.array([ROBOT.home, end])) for end in ends[[0, 1, 1, 1]]]
    small = bed_of(paths, np.array([0, 1, 1, 1]), tool_positions(ends))
    assert len(chosen(small, "BehaviorRetrieval", 1, **FEW).ids) == 2
    kept = chosen(small, "BehaviorRetrieval_Native", None, **FEW).kept
    assert kept["steps"][0].as_py() is None
    assert kept["weight"][0].as_py() == 1
