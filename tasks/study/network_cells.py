"""What one network of a study is, in the words of result rows."""

from __future__ import annotations

from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.networks import Network
from plancurate.tasks.study.rows import ResultRow

Cell = tuple[str, str, str, int | None, int, str, int, int]
"""Scene, pool's label, selector, budget, selection seed, policy, training seed and round: what one network is."""


def cell_of_row(row: ResultRow) -> Cell:
    """Say which network a result row is about."""
    return (
        row.scene,
        row.pool_label,
        row.selector,
        row.budget,
        row.selection_seed,
        row.policy,
        row.seed,
        row.round,
    )


def cell_of_network(study: StudyContext, network: Network) -> Cell:
    """Say which network a network is, in the words of result rows."""
    wanted, pool = network.selection, study.pool(network.selection.pool)
    return (
        pool.scene.name,
        pool.label,
        wanted.choice.label,
        wanted.budget,
        wanted.seed,
        network.policy,
        network.seed,
        network.round,
    )
