"""Bootstrap intervals and paired tests against slow code of their own, and against results known by hand."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest

from plancurate.tasks.study.bootstrap import (
    Counts,
    Grid,
    drawn_counts,
    network_weights,
    paired_difference,
    pooled,
    rate_interval,
    target_counts,
    varied,
)


def grid(rows: list[str], policies: str, selection_seeds: str, seeds: str) -> Grid:
    """Networks (a row each) at targets: 1 success, 0 failure, - not tested."""
    cells = np.array([list(row) for row in rows])
    numbers = (tuple(int(digit) for digit in text) for text in (selection_seeds, seeds))
    return Grid(cells == "1", cells != "-", tuple(policies), *numbers)


def one(row: str) -> Grid:
    """A single network."""
    return grid([row], "p", "0", "0")


def draws(tested: Grid, seed: int = 0, n: int = 10_000) -> Counts:
    """All policies' draws; the same test targets for the same seed and number of targets."""
    targets = target_counts(tested.success.shape[1], np.random.default_rng(seed), n)
    return pooled(drawn_counts(tested, targets, network_weights(tested, np.random.default_rng(99), n)))


NESTED = grid(["110", "100", "011", "111"], "pppp", "0011", "0101")


def test_counts_of_each_draw_are_those_of_plain_loops() -> None:
    tested = grid(["1101", "0-10", "0111", "1111", "0001"], "ppqqq", "01011", "00012")
    targets = target_counts(4, np.random.default_rng(1), 50)
    weights = network_weights(tested, np.random.default_rng(2), 50)
    found = drawn_counts(tested, targets, weights)
    for policy, draw in itertools.product("pq", range(51)):
        successes, trials = [0.0, 0.0], 0.0
        for network in range(5):
            if tested.policies[network] != policy:
                continue
            for target in range(4):
                times = weights[draw, network] * targets[draw, target]
                trials += times * tested.tried[network, target]
                for imagined in (0, 1):
                    successes[imagined] += times * tested.success[network, target]
            for imagined in (0, 1):
                times = weights[draw, network] * targets[draw, 4 + imagined]
                trials += times
                successes[imagined] += times
        size = 1 if draw == 0 else 6 / 5  # 5 of 6 targets are drawn
        assert found[policy][draw] == pytest.approx([size * value for value in (*successes, trials)])


def every_rate(tested: Grid, imagined: tuple[int, int]) -> list[float]:
    """The rate of every equally likely draw, for one policy, two selection seeds and two training seeds."""
    n = tested.success.shape[1]
    rates = []
    for network, drawn in itertools.product(range(4), itertools.product(range(n + 2), repeat=n + 1)):
        # One of two selection seeds and in it one of two training seeds: one of four networks.
        reached = [*tested.success[network], *imagined]
        tried = [*tested.tried[network], True, True]
        rates.append(sum(reached[i] for i in drawn) / sum(tried[i] for i in drawn))
    return rates


def test_draws_have_the_distribution_of_every_possible_draw() -> None:
    exact = every_rate(NESTED, (1, 0))
    counts = draws(NESTED, n=40_000)
    rates = counts[1:, 0] / counts[1:, 2]
    assert rates.mean() == pytest.approx(np.mean(exact), abs=0.005)
    assert rates.std() == pytest.approx(np.std(exact), rel=0.02)
    expected, found = Counter(np.round(exact, 9)), Counter(np.round(rates, 9))
    assert set(found) == set(expected)
    for rate, times in expected.items():
        assert found[rate] / 40_000 == pytest.approx(times / len(exact), abs=0.01)
    interval = rate_interval(counts, confidence=0.5)
    assert (interval.low, interval.high) == pytest.approx(tuple(np.quantile(exact, [0.25, 0.75])))


def test_a_paired_difference_of_single_networks_by_hand() -> None:
    # Differences 1, 1, 1, 0, -1 and, imagined, 1 and -1: mean 2/7, squares 6, variance (6 - 4/7) / 6.
    estimate = paired_difference(draws(one("11100"), n=40_000), draws(one("00001"), n=40_000))
    assert estimate.value == pytest.approx(2 / 7)
    assert estimate.error == pytest.approx(math.sqrt((6 - 4 / 7) / 6 / 7), rel=0.02)


@pytest.mark.parametrize("n", [3, 8, 40])
def test_where_all_targets_differ_the_test_grows_sure_with_their_number(n: int) -> None:
    """n differences of 1, imagined 1 and -1: mean n / (n + 2), error 2 / (n + 2), so z = n / 2."""
    estimate = paired_difference(draws(one("1" * n)), draws(one("0" * n)))
    assert estimate.test.statistic == pytest.approx(n / 2, rel=0.03)
    assert (estimate.test.p < 0.05) == (n > 3)


def test_equal_selections_do_not_differ_and_turned_round_a_difference_changes_its_sign() -> None:
    a, b = draws(one("1100101")), draws(one("0110111"))
    assert paired_difference(a, a).test.p == 1.0
    there, back = paired_difference(a, b), paired_difference(b, a)
    assert back.value == pytest.approx(-there.value)
    assert back.error == pytest.approx(there.error, rel=0.03)


def test_targets_that_are_hard_for_both_widen_the_rates_and_not_their_difference() -> None:
    a, b = "1" * 30 + "0" * 30, "1" * 28 + "0" * 32
    paired = paired_difference(draws(one(a)), draws(one(b)))
    apart = paired_difference(draws(one(a)), draws(one(b), seed=5))
    assert paired.error < 0.5 * apart.error


@pytest.mark.slow
def test_selection_seeds_widen_an_interval_by_their_sample_variance() -> None:
    """Four selections, two always and two never successful: the mean's variance is (1/3) / 4."""
    tested = grid(["1" * 400, "1" * 400, "0" * 400, "0" * 400], "pppp", "0123", "0000")
    counts = draws(tested)
    rates = counts[1:, 0] / counts[1:, 2]
    assert rates.std() == pytest.approx(math.sqrt(1 / 12), rel=0.03)
    alone = rate_interval(draws(one("10" * 200)))
    interval = rate_interval(counts)
    assert interval.high - interval.low > 5 * (alone.high - alone.low)


@pytest.mark.slow
def test_training_seeds_are_drawn_within_their_policy() -> None:
    tested = grid(["1" * 300, "1" * 300, "0" * 300, "0" * 300], "ppqq", "0000", "0101")
    counts = draws(tested)
    rates = counts[1:, 0] / counts[1:, 2]
    assert rates.std() < 0.01  # each policy's networks are alike
    together = grid(["1" * 300, "1" * 300, "0" * 300, "0" * 300], "pppp", "0000", "0123")
    counts = draws(together)
    assert (counts[1:, 0] / counts[1:, 2]).std() > 0.2


@pytest.mark.parametrize("rate", ["1", "0"])
def test_a_rate_at_an_end_is_not_certain(rate: str) -> None:
    interval = rate_interval(draws(one(rate * 80)))
    assert interval.high - interval.low == pytest.approx(0.036, abs=0.012)
    assert (interval.high if rate == "1" else interval.low) == float(rate)


def test_a_policy_that_a_selection_seed_lacks_is_left_out_of_its_draws() -> None:
    tested = grid(["11", "10"], "pq", "01", "00")
    targets = target_counts(2, np.random.default_rng(0), 200)
    counts = drawn_counts(tested, targets, network_weights(tested, np.random.default_rng(0), 200))
    assert 0.0 in counts["p"][:, 2]
    interval = rate_interval(counts["p"])
    assert 0 <= interval.low <= interval.high <= 1


def test_what_was_drawn_is_said_in_words() -> None:
    assert varied(one("1")) == "targets only"
    assert varied(grid(["1", "1"], "pp", "00", "01")) == "training seeds and targets"
    assert varied(NESTED) == "selection seeds, training seeds and targets"
    assert varied(grid(["1", "1"], "pq", "01", "00")) == "selection seeds and targets"


@pytest.mark.slow
def test_selections_of_one_law_are_seldom_told_apart() -> None:
    """120 pairs of selections whose networks and targets vary by chance alone: about one in twenty may differ."""
    rng = np.random.default_rng(3)

    def drawn_selection(hardness: np.ndarray) -> Grid:
        level = np.repeat(rng.normal(0, 0.5, 3), 3) + rng.normal(0, 0.5, 9)  # selection seeds, networks
        success = rng.random((9, 60)) < 1 / (1 + np.exp(-level[:, None] - hardness))
        return Grid(success, np.ones_like(success), ("p",) * 9, (0, 0, 0, 1, 1, 1, 2, 2, 2), (0, 1, 2) * 3)

    sure = plain = 0
    for study in range(120):
        hardness = rng.normal(0, 1, 60)
        grids = [drawn_selection(hardness) for _ in range(2)]
        targets = target_counts(60, np.random.default_rng(study), 400)
        a, b = (
            pooled(drawn_counts(g, targets, network_weights(g, np.random.default_rng([study, i]), 400)))
            for i, g in enumerate(grids)
        )
        sure += paired_difference(a, b).test.p < 0.05
        rates = [g.success.mean() for g in grids]
        pool = np.mean(rates)
        plain += abs(rates[0] - rates[1]) > 1.96 * math.sqrt(pool * (1 - pool) * 2 / 540)
    assert sure <= 15
    assert plain >= 40  # the test that takes every trial for independent
