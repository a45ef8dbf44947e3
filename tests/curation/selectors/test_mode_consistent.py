from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from plancurate.tasks.curation.pool import make_pool
from plancurate.tasks.curation.selectors import path_groups
from plancurate.tasks.curation.selectors.agreement import (
    NONE,
    Graph,
    energy,
    labelling,
    settled,
    without_strangers,
)
from plancurate.tasks.curation.selectors.mode_consistent import distances, neighbours
from plancurate.tasks.curation.selectors.path_groups import path_classes
from plancurate.tasks.curation.selectors.selection import Selection

from .defects import ROBOT, Bed, IntArray, bed_of, chosen, curve, defective_pool, tool_positions

SIDE, EACH = 5, 3
LEFT, RIGHT = 1, -1


def two_ways(left_lift: float = 0.9, right_lift: float = 0.9, only_right: int = -1) -> tuple[Bed, IntArray]:
    """A grid of targets, each reached by swinging the arm to the left or to the right; and each candidate's side."""
    rng = np.random.default_rng(3)
    paths, target, side = [], [], []
    goals = [
        ROBOT.home + np.array([0, 0.12 * row, 0.3 + 0.12 * column, 0, 0, 0])
        for row, column in product(range(SIDE), repeat=2)
    ]
    for number, goal in enumerate(goals):
        for way, lift in ((LEFT, left_lift), (RIGHT, right_lift)):
            for _ in range(0 if (way == LEFT and number == only_right) else EACH):
                turn = np.array([way * 2 * (lift + rng.uniform(0, 0.1)), 0, 0, 0, 0, 0])
                paths.append(curve(np.array([ROBOT.home, (ROBOT.home + goal) / 2 + turn, goal])))
                target.append(number)
                side.append(way)
    return bed_of(paths, np.array(target), tool_positions(np.array(goals))), np.array(side)


def kept_sides(bed: Bed, side: IntArray, selection: Selection) -> IntArray:
    rows = [bed.pool.candidates["trajectory_id"].to_pylist().index(name) for name in selection.ids]
    return side[rows]


def test_one_way_is_kept_for_all_targets_where_each_ones_best_is_on_either_side() -> None:
    bed, side = two_ways()
    assert set(kept_sides(bed, side, chosen(bed, "KMeans_Hybrid", 1))) == {LEFT, RIGHT}
    selection = chosen(bed, "ModeConsistent", 2)
    assert len(set(kept_sides(bed, side, selection))) == 1
    assert np.bincount(selection.kept["target_id"].to_numpy()).tolist() == [2] * SIDE**2
    assert len(set(selection.kept["cluster"].to_pylist())) == SIDE**2
    assert chosen(bed, "ModeConsistent", 9).kept.num_rows == EACH * SIDE**2  # all of the way, and no other


def test_without_a_price_for_disagreement_each_target_keeps_its_own_best() -> None:
    bed, _ = two_ways()
    alone = chosen(bed, "ModeConsistent", 1, agreement=0.0, leave_out=0.0)
    assert alone.ids == chosen(bed, "KMeans_Hybrid", 1).ids


def test_a_target_that_has_only_the_other_way_is_left_out() -> None:
    bed, side = two_ways(left_lift=0.7, right_lift=1.1, only_right=12)
    selection = chosen(bed, "ModeConsistent", 2)
    assert set(selection.kept["target_id"].to_pylist()) == set(range(SIDE**2)) - {12}
    assert set(kept_sides(bed, side, selection)) == {LEFT}
    all_kept = chosen(bed, "ModeConsistent", 2, leave_out=0.0)
    assert set(all_kept.kept["target_id"].to_pylist()) == set(range(SIDE**2))


def test_the_order_of_candidates_changes_nothing() -> None:
    bed, _ = two_ways()
    pool, rows = bed.pool, np.random.default_rng(0).permutation(len(bed.paths))
    shuffled = make_pool(pool.partition, pool.candidates.take(rows), pool.targets)
    other = replace(bed, pool=shuffled)
    assert chosen(other, "ModeConsistent", 2).kept.equals(chosen(bed, "ModeConsistent", 2).kept)


def test_a_path_is_of_the_first_class_that_it_follows_all_along() -> None:
    points = np.zeros((5, 4, 2))
    points[1, 2] = [0.0, 1.5]  # leaves on the way, ends where the others do
    points[2] += 0.9
    points[3, 2] = [0.0, 0.8]  # follows both; the first is the better one
    found = path_classes(points, np.array([0, 0, 0, 0, 1]), np.arange(5), radius=1.0)
    assert found.of_candidate.tolist() == [0, 1, 0, 0, 2]
    assert found.first.tolist() == [0, 1, 4]
    assert found.target.tolist() == [0, 0, 1]


def test_neighbours_are_mutual_and_the_nearest() -> None:
    found = neighbours(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [9, 0, 0]]), 1)
    assert [near.tolist() for near in found] == [[1], [0, 2], [1, 3], [2]]
    assert [near.tolist() for near in neighbours(np.zeros((1, 3)), 8)] == [[]]


def random_graph(seed: int, targets: int = 5, classes: int = 2) -> Graph:
    rng = np.random.default_rng(seed)
    together = rng.random((targets, targets, classes, classes))
    together = together + together.transpose(1, 0, 3, 2)
    near = [np.delete(np.arange(targets), target) for target in range(targets)]
    pairs = [together[target, others] for target, others in enumerate(near)]
    return Graph(rng.random((targets, classes)), near, pairs)


@pytest.mark.parametrize("seed", range(10))
def test_the_energy_is_within_a_twentieth_of_the_lowest_of_all(seed: int) -> None:
    graph = random_graph(seed)
    lowest = min(energy(graph, np.array(labels)) for labels in product(range(2), repeat=5))
    orders = [np.roll(np.arange(5), turn) for turn in range(5)]
    assert lowest <= energy(graph, labelling(graph, orders)) <= 1.05 * lowest


@pytest.mark.parametrize("seed", range(10))
def test_once_settled_no_target_would_rather_have_another_class(seed: int) -> None:
    graph = random_graph(seed, targets=12, classes=4)
    labels = settled(graph, graph.cost.argmin(axis=1))
    assert all(graph.costs(target, labels).argmin() == label for target, label in enumerate(labels))


def test_distances_of_classes_are_the_largest_differences_seen_from_either_target() -> None:
    points = np.random.default_rng(0).normal(size=(5, 4, 2))
    rows = [np.array([0, 1]), np.array([2]), np.array([3, 4])]
    near = [np.array([1, 2]), np.array([0]), np.array([0])]
    pairs = distances(rows, points, near, radius=2.0).pairs
    for target, others in enumerate(near):
        for place, other in enumerate(others):
            for (i, one), (j, two) in product(enumerate(rows[target]), enumerate(rows[other])):
                assert pairs[target][place, i, j] == np.abs(points[one] - points[two]).max() / 2.0


def test_an_energy_worked_out_by_hand_counts_each_pair_once() -> None:
    pair = np.array([[0.0, 3.0], [5.0, 0.0]])
    graph = Graph(
        np.array([[1.0, 2.0], [4.0, 8.0]]), [np.array([1]), np.array([0])], [pair[None], pair.T[None]]
    )
    assert energy(graph, np.array([0, 1])) == 1 + 8 + 3
    assert energy(graph, np.array([1, 0])) == 2 + 4 + 5
    assert energy(graph, np.array([1, NONE])) == 2
    assert settled(graph, np.array([1, 0])).tolist() == [0, 0]


def test_no_more_targets_than_allowed_are_left_out_and_the_worst_first() -> None:
    apart = np.ones((8, 8)) * 0.2
    apart[0], apart[:, 0] = 3.0, 3.0
    apart[1, 2:], apart[2:, 1] = 2.0, 2.0
    near = [np.delete(np.arange(8), target) for target in range(8)]
    distance = Graph(
        np.zeros((8, 1)), near, [apart[t, others][:, None, None] for t, others in enumerate(near)]
    )
    same = np.zeros(8, dtype=np.int64)
    assert without_strangers(distance, same, 1).tolist() == [NONE] + [0] * 7
    assert without_strangers(distance, same, 8).tolist() == [NONE, NONE] + [0] * 6
    assert without_strangers(distance, same, 0).tolist() == [0] * 8


def test_paths_read_part_by_part_are_curated_alike(monkeypatch):
    bed = defective_pool(seed=0)
    whole = chosen(bed, "ModeConsistent", budget=2).kept
    monkeypatch.setattr(path_groups, "READ_AT_ONCE", 50)
    monkeypatch.setattr(path_groups, "COMPARED_AT_ONCE", 20)
    assert len(path_groups.whole_targets(bed.target, 50)) > 2
    assert chosen(bed, "ModeConsistent", budget=2).kept == whole
