from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from plancurate.tasks.curation.selectors.duplicates import whole_duplicates
from plancurate.tasks.curation.selectors.progress import (
    DISCOUNT,
    EDGES,
    USUAL_DURATION,
    WINDOW,
    Clocked,
    class_rank,
    covering_mean,
    drawn_pairs,
    suboptimality,
    units,
)
from plancurate.tasks.curation.selectors.scizor import SCIZORSettings, Scored, kept_steps, score
from plancurate.tasks.learning.demonstrations import demonstrations

from .defects import (
    DEFECTS,
    DT,
    ROBOT,
    SCENE,
    Bed,
    auroc,
    bed_of,
    chosen,
    curve,
    defective_pool,
    far_offsets,
    problem,
    stalled,
    tool_positions,
)

pytestmark = pytest.mark.training

FEW = {"classifier_steps": 20}
"""For what does not depend on how good the classifier is."""


@pytest.fixture(scope="module")
def bed() -> Bed:
    return defective_pool(seed=0)


@pytest.fixture(scope="module")
def found(bed: Bed) -> Scored:
    return score(problem(bed), SCIZORSettings())


def mean_score(found: Scored) -> np.ndarray:
    return found.transitions.mean(found.suboptimality)


def window_steps(found: Scored) -> int:
    """Steps of the window that progress is judged over."""
    lengths = found.transitions.lengths
    return round(WINDOW / units(lengths, np.full(len(lengths), DT))[0])


def test_stalls_and_reversals_are_found(
    bed: Bed, found: Scored, record_property: Callable[[str, object], None]
) -> None:
    areas = {defect: auroc(bed, mean_score(found), defect) for defect in DEFECTS}
    for defect, area in areas.items():
        record_property(f"SCIZOR_{defect}", round(area, 3))
    assert areas["stall"] > 0.95
    assert areas["reversal"] > 0.9
    assert areas["detour"] > 0.8


def test_a_stall_is_worst_within_a_window_of_where_it_is(bed: Bed, found: Scored) -> None:
    scores = np.split(found.suboptimality, found.transitions.starts[1:])
    window = window_steps(found)
    for row in np.flatnonzero(bed.label == "stall"):
        worst = int(np.argmax(scores[row]))
        assert bed.onset[row] - window <= worst <= bed.onset[row] + bed.length[row]


def test_straight_paths_at_constant_speed_are_alike() -> None:
    ends = ROBOT.home + far_offsets(np.random.default_rng(0), 40)
    straight = [curve(np.array([ROBOT.home, end])) for end in ends]
    still = np.arange(44) % 11 == 10
    target = np.arange(44) - np.cumsum(still)  # a stalled one beside every tenth straight one
    paths = [
        stalled(straight[t], len(straight[t]) // 2, 20) if s else straight[t]
        for t, s in zip(target, still, strict=True)
    ]
    scores = mean_score(score(problem(bed_of(paths, target, tool_positions(ends))), SCIZORSettings()))
    assert scores[still].min() > scores[~still].max()
    assert scores[~still].std() < 0.2 * (scores[still].mean() - scores[~still].mean())


def test_one_of_each_exact_duplicate_remains() -> None:
    rng = np.random.default_rng(1)
    ends = np.repeat(ROBOT.home + far_offsets(rng, 3), 8, axis=0)
    vias = (ROBOT.home + ends) / 2 + 0.8 * far_offsets(rng, 24)
    paths = [curve(np.array([ROBOT.home, via, end])) for via, end in zip(vias, ends, strict=True)]
    target = np.repeat(np.arange(3), 8)
    twice = bed_of([p for p in paths for _ in (0, 1)], np.repeat(target, 2), tool_positions(ends[::8]))
    found = score(problem(twice), SCIZORSettings(**FEW))
    copies = whole_duplicates(found.chunks, found.duplicate, 48)
    assert copies.tolist() == [False, True] * 24
    for name, budget in (("SCIZOR", 8), ("SCIZOR_Global", 8), ("SCIZOR_Native", None)):
        runs = chosen(twice, name, budget, **FEW).kept["trajectory_id"].to_pylist()
        assert all(int(run[-3:]) % 2 == 0 for run in runs)


def test_beginnings_and_ends_are_not_all_deleted(bed: Bed, found: Scored) -> None:
    kept, steps = kept_steps(found, 0.707), found.transitions
    last = kept[steps.starts + steps.lengths - 1]
    assert (last == np.logical_or.reduceat(kept, steps.starts)).all()
    for target in range(bed.pool.n_targets):
        assert kept[steps.starts][bed.target == target].any()
        assert last[bed.target == target].mean() > 0.5


def test_the_share_is_kept_where_nothing_is_repeated(bed: Bed) -> None:
    found = score(problem(bed), SCIZORSettings(duplicate_similarity=1.0, **FEW))
    found = Scored(found.transitions, found.suboptimality, found.chunks, np.zeros_like(found.duplicate))
    for share in (0.3, 0.707):
        assert kept_steps(found, share).mean() == pytest.approx(share, abs=0.01)


def test_what_windows_hold_is_never_glued(bed: Bed) -> None:
    kept = chosen(bed, "SCIZOR_Native", None, **FEW).kept
    ids, steps = kept["trajectory_id"].to_pylist(), kept["steps"].to_pylist()
    paths = bed.waypoints(ids)
    data = demonstrations(ROBOT, SCENE, paths, np.zeros((len(paths), 3)), steps=[np.array(s) for s in steps])
    episode = np.searchsorted(data.starts, data.window_starts, side="right") - 1
    for first, number in zip(data.window_starts[::97], episode[::97], strict=True):
        path, begin = paths[number], first - data.starts[number]
        expected = path[np.minimum(begin + np.arange(10), len(path) - 1)]
        window = data.windows(np.array([first]), 10)[0]
        np.testing.assert_allclose(data.observations[window, 3:], expected, atol=1e-6)
    assert len(data.window_starts) < 0.8 * len(data.observations)


@pytest.mark.parametrize("budget", [1, 5, 30])
def test_budgets_are_kept_for_each_target_or_the_pool(bed: Bed, budget: int) -> None:
    each = chosen(bed, "SCIZOR", budget, **FEW)
    assert (np.bincount(each.kept["target_id"].to_numpy()) == budget).all()
    pool = chosen(bed, "SCIZOR_Global", budget, **FEW)
    assert len(set(pool.ids)) == budget * bed.pool.n_targets
    assert min(each.kept["score"].to_pylist()) == min(pool.kept["score"].to_pylist())


@pytest.mark.parametrize("name", ["SCIZOR", "SCIZOR_Native"])
def test_the_seed_decides_and_the_number_of_threads_does_not(bed: Bed, name: str) -> None:
    budget = None if name.endswith("Native") else 5
    threads = torch.get_num_threads()
    kept = []
    try:
        for count in (1, 2):
            torch.set_num_threads(count)
            kept.append(chosen(bed, name, budget, seed=3, **FEW).kept)
    finally:
        torch.set_num_threads(threads)
    assert kept[0].equals(kept[1])
    assert not kept[0].equals(chosen(bed, name, budget, seed=4, **FEW).kept)


def test_ranks_of_elapsed_time_run_through_the_middles_of_classes() -> None:
    elapsed = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.5, WINDOW])
    np.testing.assert_allclose(class_rank(elapsed), [0, 0, 0.5, 1, 1.5, 2, 2.5])


def test_scores_spread_as_the_plain_loops_do() -> None:
    rng = np.random.default_rng(0)
    lengths = np.array([1, 30, 50])
    step = np.full(3, 0.15)
    clocked = Clocked(np.zeros((81, 9), np.float32), np.array([0, 1, 31]), lengths, step)
    lack = rng.random(81)
    window = round(WINDOW / 0.15)
    expected = []
    for own in np.split(lack, [1, 31]):
        blamed = [own[max(0, i - window + 1) : i + 1].mean() for i in range(len(own))]
        np.testing.assert_allclose(covering_mean(own, window), blamed)
        for i in range(len(own) - 1, 0, -1):
            blamed[i - 1] += DISCOUNT**0.15 * blamed[i]
        expected += [(value + np.mean(blamed)) / 2 for value in blamed]
    np.testing.assert_allclose(suboptimality(clocked, lack), expected)


def test_pairs_carry_the_class_of_the_time_between_them() -> None:
    lengths = np.array([1, 20, 200])
    step = np.full(3, 0.1)
    number = np.concatenate([np.arange(n) for n in lengths]).astype(np.float32)
    clocked = Clocked(number[:, None], np.array([0, 1, 21]), lengths, step)
    pairs, classes = drawn_pairs(clocked, 4000, np.random.default_rng(0))
    elapsed = pairs[:, 2] * 0.1
    np.testing.assert_allclose(pairs[:, 1] - pairs[:, 0], pairs[:, 2], atol=1e-4)
    assert elapsed.max() > EDGES[-1]
    clear = np.abs(elapsed[:, None] - np.asarray(EDGES)[1:]).min(axis=1) > 1e-3
    assert (np.searchsorted(EDGES, elapsed[clear], side="right") - 1 == classes[clear]).all()
    assert (np.bincount(classes, minlength=5) > 0).all()


def test_time_is_counted_in_usual_durations() -> None:
    lengths = np.array([11, 21, 101])
    step = units(lengths, np.full(3, 0.05))
    assert (20 * step[1]) == pytest.approx(USUAL_DURATION)
    assert (step == step[0]).all()
